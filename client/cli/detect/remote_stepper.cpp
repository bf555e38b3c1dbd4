// SPDX-License-Identifier: Apache-2.0
// The stepper over the client library. Thread safety as stated in stepper.h.
#include "client/cli/detect/remote_stepper.h"

#include <chrono>
#include <cstdio>
#include <utility>
#include <variant>
#include <vector>

#include "client/lib/client.h"

namespace warmfront::client {
namespace {

StepAnswer to_step_answer(const Answer& answer) {
  StepAnswer step{answer.vf, answer.ee, answer.vh,         answer.possible, answer.earliest_toi,
                  {},        {},        answer.statistics, std::nullopt};
  if (answer.all_deformable) step.all_deformable = answer.all_deformable->statistics;
  const ContactTable& table = answer.contacts;
  step.contacts.reserve(table.size());
  for (std::size_t i = 0; i < table.size(); ++i)
    step.contacts.push_back({table.kind[i], table.status[i], table.vertices[i], table.toi[i]});
  if (table.has_geometry()) step.geometry.resize(table.size());
  for (std::size_t i = 0; i < step.geometry.size(); ++i) step.geometry[i] = table.geometry(i);
  return step;
}

class RemoteStepper final : public Stepper {
 public:
  RemoteStepper(Client client, Session session, int threads)
      : client_(std::move(client)), session_(std::move(session)), threads_(threads) {}

  Result<StepAnswer> step(const Frame& frame) override {
    if (Status handed_over = submit(frame); !handed_over) return handed_over.error();
    return next_answer();
  }

  std::size_t window() const override { return session_.window(); }
  Status submit(const Frame& frame) override {
    const Result<std::uint64_t> number = session_.submit(frame);
    return number ? Status{} : Status{number.error()};
  }
  Result<StepAnswer> next_answer() override {
    Result<Answer> answer = session_.next_answer();
    if (!answer) return answer.error();
    return to_step_answer(answer.value());
  }

  Status replace(std::vector<ReplacedBody> bodies, const Positions& positions) override {
    for (ReplacedBody& body : bodies) {
      const Positions own = rows_of(positions, body.first_vertex, body.with.body.vertex_count);
      if (Status status = session_.replace_body(body.index, std::move(body.with), own); !status)
        return status;
    }
    return place(Frame(positions));
  }

  Status place(const Frame& frame) override {
    const Result<Answer> placed = session_.place(frame);
    return placed ? Status{} : Status{placed.error()};
  }

  int threads() const override { return threads_; }

 private:
  Client client_;
  Session session_;
  const int threads_;
};

}  // namespace

Result<std::unique_ptr<Stepper>> make_remote_stepper(const std::string& address,
                                                     const ClientOptions& connection,
                                                     const SceneDescription& scene,
                                                     const Positions& positions,
                                                     const ColliderOptions& options) {
  ClientOptions to_daemon = connection;
  // No other output is printed meanwhile, and resuming may take as long as the resume timeout.
  to_daemon.on_lost = [address, timeout = to_daemon.resume_timeout](const Error& why) {
    std::fprintf(stderr, "warmfront: the session was lost (%s); resuming it at %s within %lld s\n",
                 why.message.c_str(), address.c_str(),
                 static_cast<long long>(std::chrono::ceil<std::chrono::seconds>(timeout).count()));
  };
  Result<Client> client = Client::connect(address, std::move(to_daemon));
  if (!client) return client.error();
  const Result<ServerInfo> server = client.value().server_info();
  if (!server) return server.error();
  Result<Session> session = client.value().create_session(scene, positions, options);
  if (!session) return session.error();
  return std::unique_ptr<Stepper>(std::make_unique<RemoteStepper>(
      std::move(client).value(), std::move(session).value(), static_cast<int>(server.value().threads)));
}

}  // namespace warmfront::client
