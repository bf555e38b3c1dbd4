// SPDX-License-Identifier: Apache-2.0
// What the plug for IPC Toolkit takes beside that library's own broad phases, in one run, in turns: the
// candidates of each motion from frame to frame, of each frame standing, and of what a solver asks in between
// (four times on the way: a state for its barrier, a motion for its step, the state where that ends); then
// how far each motion may go, by broad and narrow phases of either. Prints processor time (the first and the
// median, the latter as a multiple of ours) and the mean of how many candidates there are, or how far it may
// go; passes no verdict.
//   ipc_toolkit_bench THREADS RADIUS FIRST LAST INPUT   RADIUS in edge lengths (of a state; motions have
//   none)
#include <tbb/global_control.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <ipc/broad_phase/create_broad_phase.hpp>
#include <ipc/candidates/candidates.hpp>
#include <ipc/ccd/additive_ccd.hpp>
#include <ipc/ccd/tight_inclusion_ccd.hpp>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "client/io/input.h"
#include "client/ipc_toolkit/broad_phase.h"
#include "client/ipc_toolkit/narrow_phase_ccd.h"
#include "tests/bench/timing.h"

namespace warmfront::testing {
namespace {

using Vertices = Eigen::MatrixXd;

struct Sequence {
  Eigen::MatrixXi edges, faces;
  std::vector<Vertices> frames;

  double edge_length() const {
    double sum = 0;
    for (const auto& edge : edges.rowwise())
      sum += (frames.front().row(edge[0]) - frames.front().row(edge[1])).norm();
    return sum / static_cast<double>(edges.rows());
  }
};

Sequence read(const std::string& path, std::uint32_t first, std::uint32_t last) {
  const auto input = client::open_input(std::vector<std::string>{path}).value();
  Sequence sequence;
  const auto& faces = input->scene().faces;
  std::set<std::pair<int, int>> sides;
  sequence.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      sequence.faces(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(k)) = faces[f][k];
      sides.insert(std::minmax(faces[f][k], faces[f][(k + 1) % 3]));
    }
  }
  sequence.edges.resize(static_cast<Eigen::Index>(sides.size()), 2);
  Eigen::Index e = 0;
  for (const auto& [a, b] : sides) sequence.edges.row(e++) << a, b;
  client::PositionBuffer buffer;
  for (std::uint32_t k = first; k <= std::min(last, input->frame_count() - 1); ++k) {
    if (const Status done = input->read_frame(k, buffer); !done)
      throw std::runtime_error(done.error().message);
    Vertices& frame = sequence.frames.emplace_back(input->scene().vertex_count, 3);
    for (Eigen::Index i = 0; i < frame.rows(); ++i)
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        frame(i, axis) = client::coordinate(client::view(buffer), static_cast<std::size_t>(3 * i + axis));
  }
  return sequence;
}

/// One way to answer, and what it tells of each motion: a number to be averaged.
struct Way {
  std::string name;
  std::function<double(const Vertices& from, const Vertices& to)> ask;
};

// Of the processor, all threads together: others may use the machine, too.
double milliseconds() {
  return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

void print(const char* question, const Sequence& sequence, const std::vector<Way>& ways) {
  std::vector<std::vector<double>> ms(ways.size());
  std::vector<double> told(ways.size());
  for (std::size_t k = 0; k + 1 < sequence.frames.size(); ++k) {
    for (std::size_t w = 0; w < ways.size(); ++w) {
      const double start = milliseconds();
      told[w] += ways[w].ask(sequence.frames[k], sequence.frames[k + 1]);
      ms[w].push_back(milliseconds() - start);
    }
  }
  for (std::size_t w = 0; w < ways.size(); ++w)
    std::printf("%-8s %-34s first %9.2f ms, median %9.2f ms, %7.2f times ours; %14.4f\n", question,
                ways[w].name.c_str(), ms[w].front(), median(ms[w]), median(ms[w]) / median(ms[0]),
                told[w] / static_cast<double>(ms[w].size()));
}

void run(int threads, double radius, const Sequence& sequence) {
  const ::ipc::CollisionMesh mesh(sequence.frames.front(), sequence.edges, sequence.faces);
  const double inflation = radius * sequence.edge_length();
  std::vector<std::shared_ptr<::ipc::BroadPhase>> methods{std::make_shared<ipc_toolkit::BroadPhase>(threads)};
  for (const auto method : {::ipc::BroadPhaseMethod::LBVH, ::ipc::BroadPhaseMethod::HASH_GRID,
                            ::ipc::BroadPhaseMethod::SPATIAL_HASH, ::ipc::BroadPhaseMethod::SWEEP_AND_PRUNE})
    methods.push_back(::ipc::create_broad_phase(method));
  ::ipc::Candidates candidates;
  std::vector<Way> motions, states, solvers;
  for (const auto& method : methods) {
    motions.push_back({method->name(), [&](const Vertices& from, const Vertices& to) {
                         candidates.build(mesh, from, to, 0, method.get());
                         return static_cast<double>(candidates.size());
                       }});
    states.push_back({method->name(), [&](const Vertices&, const Vertices& to) {
                        candidates.build(mesh, to, inflation, method.get());
                        return static_cast<double>(candidates.size());
                      }});
    solvers.push_back({method->name(), [&](const Vertices& from, const Vertices& to) {
                         double count = 0;
                         for (int k = 0; k < 4; ++k) {
                           const Vertices at = from + k / 4.0 * (to - from);
                           const Vertices next = from + (k + 1) / 4.0 * (to - from);
                           candidates.build(mesh, at, inflation, method.get());
                           candidates.build(mesh, at, next, 0, method.get());
                           candidates.build(mesh, next, inflation, method.get());
                           count += static_cast<double>(candidates.size());
                         }
                         return count;
                       }});
  }
  print("motions", sequence, motions);
  print("states", sequence, states);
  print("solver", sequence, solvers);

  ipc_toolkit::NarrowPhaseCCD ours;
  ours.most_kept = 1e-4;  // as Tight Inclusion has it
  const ::ipc::TightInclusionCCD tight_inclusion;
  const ::ipc::AdditiveCCD additive;
  // A method of its own for each, which has not been asked the same just before.
  const auto steps = [&](std::shared_ptr<::ipc::BroadPhase> method, const ::ipc::NarrowPhaseCCD& ccd) {
    return [&, method](const Vertices& from, const Vertices& to) {
      candidates.build(mesh, from, to, 0, method.get());
      return candidates.compute_collision_free_stepsize(mesh, from, to, 0, ccd);
    };
  };
  const auto warm = [&] { return std::make_shared<ipc_toolkit::BroadPhase>(threads); };
  print("steps", sequence,
        {{"Warmfront, Warmfront", steps(warm(), ours)},
         {"Warmfront, Tight Inclusion", steps(warm(), tight_inclusion)},
         {"Warmfront, additive", steps(warm(), additive)},
         {"LBVH, Warmfront", steps(methods[1], ours)},
         {"LBVH, Tight Inclusion", steps(methods[1], tight_inclusion)},
         {"LBVH, additive", steps(methods[1], additive)}});
}

}  // namespace
}  // namespace warmfront::testing

int main(int argc, char** argv) {
  if (argc != 6) {
    std::fprintf(stderr, "ipc_toolkit_bench THREADS RADIUS FIRST LAST INPUT\n");
    return 3;
  }
  const int threads = std::atoi(argv[1]);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(threads));
  warmfront::testing::run(threads, std::atof(argv[2]),
                          warmfront::testing::read(argv[5], static_cast<std::uint32_t>(std::atoi(argv[3])),
                                                   static_cast<std::uint32_t>(std::atoi(argv[4]))));
  return 0;
}
