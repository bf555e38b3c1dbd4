// SPDX-License-Identifier: Apache-2.0
// Metrics to text by prometheus-cpp. Thread-safe.
#include "server/observe/metrics_text.h"

#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/observe/process_stats.h"
#include "server/process/free_memory.h"
#include "server/process/guarded_receive.h"
#include "server/version.h"

namespace warmfront::server {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;

double value_of(const Counter& counter) {
  return static_cast<double>(counter.load(std::memory_order_relaxed));
}

class Families {
 public:
  void gauge(const char* name, const char* help, double value, std::vector<ClientMetric::Label> labels = {}) {
    ClientMetric metric;
    metric.label = std::move(labels);
    metric.gauge.value = value;
    add(name, help, MetricType::Gauge, {std::move(metric)});
  }
  /// Its name alone where there is no value.
  void gauge_if(bool there, const char* name, const char* help, double value) {
    if (there)
      gauge(name, help, value);
    else
      add(name, help, MetricType::Gauge, {});
  }
  void gauges(const char* name, const char* help, const char* label,
              std::span<const std::pair<std::string, double>> values) {
    labelled(name, help, MetricType::Gauge, label, values,
             [](ClientMetric& metric, double value) { metric.gauge.value = value; });
  }
  void counters(const char* name, const char* help, const char* label,
                std::span<const std::pair<std::string, double>> values) {
    labelled(name, help, MetricType::Counter, label, values,
             [](ClientMetric& metric, double value) { metric.counter.value = value; });
  }
  void counter(const char* name, const char* help, const Counter& counter) {
    this->counter(name, help, value_of(counter));
  }
  void counter(const char* name, const char* help, double value) {
    ClientMetric metric;
    metric.counter.value = value;
    add(name, help, MetricType::Counter, {std::move(metric)});
  }
  void counters(const char* name, const char* help, const char* label, std::span<const char* const> values,
                std::span<const Counter> counters) {
    std::vector<ClientMetric> metrics(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      metrics[i].label = {{label, values[i]}};
      metrics[i].counter.value = value_of(counters[i]);
    }
    add(name, help, MetricType::Counter, std::move(metrics));
  }
  void histograms(const char* name, const char* help, const char* label, std::span<const char* const> values,
                  std::span<const DurationHistogram> histograms) {
    std::vector<ClientMetric> metrics(histograms.size());
    for (std::size_t i = 0; i < histograms.size(); ++i) {
      if (!values.empty()) metrics[i].label = {{label, values[i]}};
      ClientMetric::Histogram& histogram = metrics[i].histogram;
      for (std::size_t b = 0; b < DurationHistogram::kBuckets; ++b) {
        histogram.sample_count += histograms[i].count(b);
        histogram.bucket.push_back({histogram.sample_count, b + 1 < DurationHistogram::kBuckets
                                                                ? DurationHistogram::upper_bound_seconds(b)
                                                                : std::numeric_limits<double>::infinity()});
      }
      histogram.sample_sum = histograms[i].sum_seconds();
    }
    add(name, help, MetricType::Histogram, std::move(metrics));
  }

  std::string text() const { return prometheus::TextSerializer().Serialize(families_); }

 private:
  template <class Set>
  void labelled(const char* name, const char* help, MetricType type, const char* label,
                std::span<const std::pair<std::string, double>> values, Set set) {
    std::vector<ClientMetric> metrics(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      metrics[i].label = {{label, values[i].first}};
      set(metrics[i], values[i].second);
    }
    add(name, help, type, std::move(metrics));
  }
  void add(const char* name, const char* help, MetricType type, std::vector<ClientMetric> metrics) {
    families_.push_back({name, help, type, std::move(metrics)});
  }
  std::vector<MetricFamily> families_;
};

}  // namespace

std::string metrics_text(const Metrics& metrics, const Gauges& gauges) {
  Families f;
  const auto number = [](std::uint64_t n) { return static_cast<double>(n); };
  f.gauge("warmfront_build_info", "Constant 1; the version is a label", 1, {{"version", kVersion}});
  f.gauge("warmfront_threads", "Threads that steps run on", number(gauges.threads));
  f.gauge("warmfront_draining", "1 while the daemon is about to stop", gauges.draining ? 1 : 0);
  f.gauge("warmfront_sessions", "Sessions open", number(gauges.sessions));
  f.gauge("warmfront_session_memory_bytes", "Memory charged to sessions: held, or reserved when that is more",
          number(gauges.charged_bytes));
  f.gauge("warmfront_session_memory_limit_bytes", "The limit of that", number(gauges.max_bytes));
  f.gauge("warmfront_shared_memory_bytes",
          "Memory shared with clients of Unix sockets, which sessions are charged for",
          number(gauges.shared_bytes));
  f.gauge("warmfront_open_streams", "StreamSteps calls open", number(gauges.open_streams));
  f.gauge("warmfront_frames_in_flight", "Frames accepted and not yet computed",
          number(gauges.frames_in_flight));
  const auto of_tenants = [&](auto value) {
    std::vector<std::pair<std::string, double>> values;
    for (const Gauges::Tenant& tenant : gauges.tenants)
      values.emplace_back(tenant.name, static_cast<double>(value(tenant)));
    return values;
  };
  const auto by_principal = [&](const char* name, const char* help, auto value) {
    f.gauges(name, help, "principal", of_tenants(value));
  };
  using Tenant = Gauges::Tenant;
  by_principal("warmfront_principal_sessions", "Sessions open, by principal",
               [](const Tenant& t) { return t.sessions; });
  by_principal("warmfront_principal_sessions_limit", "The quota of these",
               [](const Tenant& t) { return t.quota.sessions; });
  by_principal("warmfront_principal_memory_bytes", "Memory charged to a principal's sessions",
               [](const Tenant& t) { return t.charged_bytes; });
  by_principal("warmfront_principal_memory_limit_bytes", "The quota of that",
               [](const Tenant& t) { return t.quota.bytes; });
  by_principal("warmfront_principal_open_streams", "StreamSteps calls open, by principal",
               [](const Tenant& t) { return t.open_streams; });
  by_principal("warmfront_principal_open_streams_limit", "The quota of these",
               [](const Tenant& t) { return t.quota.streams; });
  by_principal("warmfront_principal_frames_in_flight", "Frames accepted and not yet computed, by principal",
               [](const Tenant& t) { return t.frames_in_flight; });
  by_principal("warmfront_principal_frames_in_flight_limit", "The quota of these",
               [](const Tenant& t) { return t.quota.frames; });
  by_principal("warmfront_principal_weight", "Its share of the cores beside others that wait for them",
               [](const Tenant& t) { return t.quota.weight; });
  f.counters("warmfront_principal_refused_total",
             "Creates, attaches and frames refused, by principal, since it has had something in the daemon",
             "principal", of_tenants([](const Tenant& t) { return t.refused; }));
  f.counters("warmfront_principal_steps_total",
             "Steps of a principal's sessions, since it has had something in the daemon", "principal",
             of_tenants([](const Tenant& t) { return t.steps; }));
  f.counters("warmfront_principal_step_seconds_total", "Time of these in the engine", "principal",
             of_tenants([](const Tenant& t) { return t.step_seconds; }));
  f.counters("warmfront_calls_total", "Calls begun, by method", "method", Metrics::kCallNames, metrics.calls);
  const std::array<Counter, 2> traced{gauges.traced_sent, gauges.traced_dropped};
  f.counters("warmfront_traced_frames_total",
             "Frames traced, by whether their traces went to every place that is set, or were dropped on the "
             "way to one",
             "result", std::array{"sent", "dropped"}, traced);
  f.counter("warmfront_sessions_created_total", "Sessions created", metrics.sessions_created);
  f.counters("warmfront_sessions_ended_total", "Sessions ended, by reason", "reason", Metrics::kEndNames,
             metrics.sessions_ended);
  f.histograms("warmfront_step_duration_seconds", "Time of a step in the engine, by stage", "stage",
               Metrics::kStageNames, metrics.step_seconds);
  f.histograms("warmfront_queue_duration_seconds", "Time that a frame waited for its step", "", {},
               std::span(&metrics.queue_seconds, 1));
  f.counters("warmfront_steps_total", "Steps computed, by what became of the front (rebuilt: its rebuilds)",
             "front", Metrics::kFrontNames, metrics.steps_by_front);
  f.counters("warmfront_session_rebuilds_total",
             "Fronts and hierarchies made anew in a session that was warm, by reason", "reason",
             std::span(Metrics::kRebuildNames).subspan(1), std::span(metrics.rebuilds).subspan(1));
  f.counters("warmfront_self_checks_total", "Self-checks of sessions, by what came of them", "result",
             Metrics::kSelfCheckNames, metrics.self_checks);
  f.counter("warmfront_contacts_total", "Contacts found", metrics.contacts);
  f.counter("warmfront_front_pairs_total", "Pairs that the front held, over all steps", metrics.front_pairs);
  f.counter("warmfront_front_pairs_skipped_total", "Of these, pairs that needed no look: the front's reuse",
            metrics.front_pairs_skipped);
  f.counters("warmfront_rejected_total", "Requests refused, by limit or kind of fault", "reason",
             Metrics::kRefusals, metrics.refused);
  std::array<Counter, Http2Guard::kVerdicts> ended{};
  std::ranges::copy(connections_ended(), ended.begin());
  f.counters("warmfront_connections_ended_total",
             "Connections that were ended for what their clients sent as HTTP/2, by what was wrong", "reason",
             std::span(Http2Guard::kNames).subspan(1), std::span(std::as_const(ended)).subspan(1));
  f.counter("warmfront_connections_refused_total",
            "Connections refused, since their address had as many as --max-connections-per-address allows",
            static_cast<double>(connections_refused()));
  f.gauge_if(gauges.certificate_expiry != 0, "warmfront_certificate_expiry_timestamp_seconds",
             "When the certificate that serves expires, the first of its chain, since the epoch",
             static_cast<double>(gauges.certificate_expiry));
  f.counters("warmfront_reload_failures_total",
             "Files that could not be used when they were read again, so that what was read before serves on",
             "what", Metrics::kReloadNames, metrics.reload_failures);
  f.counter("warmfront_memory_given_back_bytes_total", "Freed memory that was given back to the system",
            metrics.memory_given_back);
  if (const std::optional<MemoryUse> use = memory_use())
    f.gauge("warmfront_allocated_memory_bytes",
            "Memory that the allocator has handed out and not got back, whether in RAM or not",
            number(use->allocated));
  const ProcessStats process = process_stats();
  f.gauge("process_resident_memory_bytes", "Memory of this process that is in RAM",
          number(process.resident_bytes));
  f.gauge("process_virtual_memory_bytes", "Address space of this process", number(process.virtual_bytes));
  f.counter("process_cpu_seconds_total", "Processor time used, user and system", process.cpu_seconds);
  f.gauge("process_open_fds", "Open file descriptors", number(process.open_files));
  f.gauge("process_max_fds", "Most file descriptors that may be open", number(process.max_files));
  f.gauge("process_threads", "Threads of this process", number(process.threads));
  f.gauge("process_start_time_seconds", "Start of this process, since the epoch", process.start_time_seconds);
  return f.text();
}

}  // namespace warmfront::server
