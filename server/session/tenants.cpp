// SPDX-License-Identifier: Apache-2.0
// Principals by name. Thread safety as stated in the header.
#include "server/session/tenants.h"

#include <utility>

namespace warmfront::server {

Tenant::Tenant(std::string the_name, const Quota& quota, Gate& all_streams, Gate& all_frames)
    : name(std::move(the_name)),
      memory(quota.bytes, "max-principal-bytes"),
      streams(quota.streams, &all_streams),
      frames(quota.frames, &all_frames),
      uploads(quota.uploads),
      share(quota.weight),
      max_sessions_(quota.sessions) {}

void Tenant::set_quota(const Quota& quota) {
  memory.set_limit(quota.bytes);
  streams.set_limit(quota.streams);
  frames.set_limit(quota.frames);
  uploads.set_limit(quota.uploads);
  share.set_weight(quota.weight);
  max_sessions_.store(quota.sessions, std::memory_order_relaxed);
}

Quota Tenant::quota() const {
  return {max_sessions(), memory.limit(), streams.limit(), frames.limit(), uploads.limit(), share.weight()};
}

Fault gate_met(const Gate& of_tenant, const Gate& of_daemon, const std::string& call, const char* what,
               const char* setting, const char* quota) {
  if (of_daemon.full() && &of_daemon != &of_tenant)
    return limit_met(call + "the daemon has its limit of " + std::to_string(of_daemon.limit()) + " " + what +
                         "; try again later, or raise --" + setting,
                     setting, true);
  return limit_met(call + "this principal has its quota of " + std::to_string(of_tenant.limit()) + " " + what +
                       "; try again when some of them have ended, or have its quota raised",
                   quota, true);
}

Quota Tenants::quota_of(const std::string& principal) const {
  const auto said = quotas_.find(principal);
  return said == quotas_.end() ? for_all_ : said->second.over(for_all_);
}

std::shared_ptr<Tenant> Tenants::of(const std::string& principal) {
  const MutexLock lock(mutex_);
  const auto known = tenants_.find(principal);
  if (known != tenants_.end())
    if (std::shared_ptr<Tenant> tenant = known->second.lock()) return tenant;
  std::erase_if(tenants_, [](const auto& entry) { return entry.second.expired(); });
  auto tenant = std::make_shared<Tenant>(principal, quota_of(principal), all_streams_, all_frames_);
  tenants_.insert_or_assign(principal, tenant);
  return tenant;
}

void Tenants::set_quotas(Quotas quotas) {
  const MutexLock lock(mutex_);
  quotas_ = std::move(quotas);
  for (const auto& [name, weak] : tenants_)
    if (const std::shared_ptr<Tenant> tenant = weak.lock()) tenant->set_quota(quota_of(name));
}

std::vector<std::shared_ptr<Tenant>> Tenants::list() const {
  const MutexLock lock(mutex_);
  std::vector<std::shared_ptr<Tenant>> living;
  for (const auto& [name, weak] : tenants_)
    if (std::shared_ptr<Tenant> tenant = weak.lock()) living.push_back(std::move(tenant));
  return living;
}

}  // namespace warmfront::server
