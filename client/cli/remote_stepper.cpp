// SPDX-License-Identifier: Apache-2.0
// The stepper over the client library. Thread safety as stated in stepper.h.
#include "client/cli/remote_stepper.h"

#include <utility>
#include <variant>

#include "client/lib/client.h"

namespace warmfront::client {
namespace {

using Floats = std::span<const float>;
using Doubles = std::span<const double>;

std::vector<double> widen(Floats positions) {
  return {positions.begin(), positions.end()};
}

StepAnswer to_step_answer(const Answer& answer) {
  StepAnswer step{answer.vf, answer.ee, answer.possible, answer.earliest_toi, {}, answer.statistics};
  const ContactTable& table = answer.contacts;
  step.contacts.reserve(table.size());
  for (std::size_t i = 0; i < table.size(); ++i)
    step.contacts.push_back({table.kind[i], table.status[i], table.vertices[i], table.toi[i]});
  return step;
}

/// Frames may change between float32 and float64 (substeps are float64), a session may not. One that was made
/// with float32 is made again with float64, from the positions before, when the first such frame comes: its
/// answers are the same.
class RemoteStepper final : public Stepper {
 public:
  RemoteStepper(Client client, Session session, const SceneDescription& scene, const Positions& positions,
                const ColliderOptions& options, int threads)
      : client_(std::move(client)),
        session_(std::move(session)),
        scene_(scene),
        options_(options),
        threads_(threads) {
    remember(positions);
  }

  Result<StepAnswer> step(const Positions& positions) override {
    if (float32_ && std::holds_alternative<Doubles>(positions)) {
      const std::vector<double> before = widen(last_floats_);
      Result<Session> session = client_.create_session(scene_, Doubles(before), options_);
      if (!session) return session.error();
      session_ = std::move(session).value();
    } else if (!float32_ && std::holds_alternative<Floats>(positions)) {
      const std::vector<double> wide = widen(std::get<Floats>(positions));
      return step(Doubles(wide));
    }
    Result<Answer> answer = session_.step(positions);
    if (!answer) return answer.error();
    remember(positions);
    return to_step_answer(answer.value());
  }

  int threads() const override { return threads_; }

 private:
  void remember(const Positions& positions) {
    const auto* floats = std::get_if<Floats>(&positions);
    float32_ = floats != nullptr;
    last_floats_.assign(float32_ ? floats->begin() : Floats::iterator{},
                        float32_ ? floats->end() : Floats::iterator{});
  }

  Client client_;
  Session session_;
  const SceneDescription scene_;
  const ColliderOptions options_;
  const int threads_;
  bool float32_ = false;            ///< of the session
  std::vector<float> last_floats_;  ///< the positions last answered, if so
};

}  // namespace

Result<std::unique_ptr<Stepper>> make_remote_stepper(const std::string& address,
                                                     const ClientSecurity& security,
                                                     const SceneDescription& scene,
                                                     const Positions& positions,
                                                     const ColliderOptions& options) {
  Result<Client> client = Client::connect(address, {.security = security});
  if (!client) return client.error();
  const Result<ServerInfo> server = client.value().server_info();
  if (!server) return server.error();
  Result<Session> session = client.value().create_session(scene, positions, options);
  if (!session) return session.error();
  return std::unique_ptr<Stepper>(
      std::make_unique<RemoteStepper>(std::move(client).value(), std::move(session).value(), scene, positions,
                                      options, static_cast<int>(server.value().threads)));
}

}  // namespace warmfront::client
