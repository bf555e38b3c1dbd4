// SPDX-License-Identifier: Apache-2.0
// Warmfront's elementary tests as a narrow phase of IPC Toolkit. Needs its headers, and C++20. Safe to call
// from any thread.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <ipc/ccd/narrow_phase_ccd.hpp>
#include <limits>
#include <optional>
#include <stdexcept>

#include "engine/pair_test.h"

namespace warmfront::ipc_toolkit {

/// Time of impact of one pair, certified: no contact is missed, and no time is later than the true one. A
/// pair that starts d apart, beyond the minimum distance m, may come as near as
///   m + (1 - conservative_rescaling) (d - m),
/// which is decided for every pair by its own d, however small; and of that share as `most_kept` says. Where
/// that is reached at once (by kSmallToi), the exact tier says when the pair comes within m itself, and
/// conservative_rescaling of that time is left: so a time of 0 is told only of a pair that starts within m.
///
/// Throws std::invalid_argument for coordinates that are not finite, and for a rescaling that is not in (0,
/// 1].
class NarrowPhaseCCD : public ::ipc::NarrowPhaseCCD {
 public:
  /// IPC Toolkit's own value, and below which time it looks again.
  static constexpr double kDefaultRescaling = 0.8;
  static constexpr double kSmallToi = 1e-6;

  /// `the_rescaling` in (0, 1]; `the_tolerance`, relative to the pair's size, as ColliderOptions::tolerance.
  explicit NarrowPhaseCCD(double the_tolerance = 1e-6, double the_rescaling = kDefaultRescaling)
      : tolerance(the_tolerance) {
    if (!(the_rescaling > 0 && the_rescaling <= 1))
      throw std::invalid_argument("warmfront: conservative_rescaling is not in (0, 1]");
    conservative_rescaling = the_rescaling;
  }

  bool point_point_ccd(Eigen::ConstRef<::ipc::VectorMax3d> p0_t0, Eigen::ConstRef<::ipc::VectorMax3d> p1_t0,
                       Eigen::ConstRef<::ipc::VectorMax3d> p0_t1, Eigen::ConstRef<::ipc::VectorMax3d> p1_t1,
                       double& toi, const double min_distance = 0.0, const double tmax = 1.0) const override {
    return test({ContactKind::kEdgeEdge,
                 {at(p0_t0), at(p0_t0), at(p1_t0), at(p1_t0)},
                 {at(p0_t1), at(p0_t1), at(p1_t1), at(p1_t1)}},
                toi, min_distance, tmax);
  }
  bool point_edge_ccd(Eigen::ConstRef<::ipc::VectorMax3d> p_t0, Eigen::ConstRef<::ipc::VectorMax3d> e0_t0,
                      Eigen::ConstRef<::ipc::VectorMax3d> e1_t0, Eigen::ConstRef<::ipc::VectorMax3d> p_t1,
                      Eigen::ConstRef<::ipc::VectorMax3d> e0_t1, Eigen::ConstRef<::ipc::VectorMax3d> e1_t1,
                      double& toi, const double min_distance = 0.0, const double tmax = 1.0) const override {
    return test({ContactKind::kEdgeEdge,
                 {at(p_t0), at(p_t0), at(e0_t0), at(e1_t0)},
                 {at(p_t1), at(p_t1), at(e0_t1), at(e1_t1)}},
                toi, min_distance, tmax);
  }
  bool point_triangle_ccd(Eigen::ConstRef<Eigen::Vector3d> p_t0, Eigen::ConstRef<Eigen::Vector3d> t0_t0,
                          Eigen::ConstRef<Eigen::Vector3d> t1_t0, Eigen::ConstRef<Eigen::Vector3d> t2_t0,
                          Eigen::ConstRef<Eigen::Vector3d> p_t1, Eigen::ConstRef<Eigen::Vector3d> t0_t1,
                          Eigen::ConstRef<Eigen::Vector3d> t1_t1, Eigen::ConstRef<Eigen::Vector3d> t2_t1,
                          double& toi, const double min_distance = 0.0,
                          const double tmax = 1.0) const override {
    return test({ContactKind::kVertexFace,
                 {at(p_t0), at(t0_t0), at(t1_t0), at(t2_t0)},
                 {at(p_t1), at(t0_t1), at(t1_t1), at(t2_t1)}},
                toi, min_distance, tmax);
  }
  bool edge_edge_ccd(Eigen::ConstRef<Eigen::Vector3d> ea0_t0, Eigen::ConstRef<Eigen::Vector3d> ea1_t0,
                     Eigen::ConstRef<Eigen::Vector3d> eb0_t0, Eigen::ConstRef<Eigen::Vector3d> eb1_t0,
                     Eigen::ConstRef<Eigen::Vector3d> ea0_t1, Eigen::ConstRef<Eigen::Vector3d> ea1_t1,
                     Eigen::ConstRef<Eigen::Vector3d> eb0_t1, Eigen::ConstRef<Eigen::Vector3d> eb1_t1,
                     double& toi, const double min_distance = 0.0, const double tmax = 1.0) const override {
    return test({ContactKind::kEdgeEdge,
                 {at(ea0_t0), at(ea1_t0), at(eb0_t0), at(eb1_t0)},
                 {at(ea0_t1), at(ea1_t1), at(eb0_t1), at(eb1_t1)}},
                toi, min_distance, tmax);
  }

  double tolerance;
  /// Of its share of d no pair has to keep more than this length: a solver's steps from afar are longer.
  double most_kept = std::numeric_limits<double>::infinity();

 private:
  template <class Vector>
  static std::array<double, 3> at(const Vector& x) {
    return {x[0], x[1], x.size() > 2 ? x[2] : 0.0};
  }

  static std::optional<PairContact> first_contact(const MovingPair& pair, const PairOptions& options) {
    const auto answer = test_pair(pair, options);
    if (!answer) throw std::invalid_argument("warmfront: " + answer.error().message);
    return answer.value();
  }

  // Before either time the pair is farther apart than m plus what that is about, so before the later one it
  // is farther apart than m plus the lesser of both.
  bool test(const MovingPair& pair, double& toi, double min_distance, double tmax) const {
    double beyond_most = 0;
    if (std::isfinite(most_kept)) {
      const auto nearer = first_contact(
          pair, {.tolerance = tolerance, .min_separation = min_distance + most_kept, .latest = tmax});
      if (!nearer) return false;
      beyond_most = nearer->toi;
    }
    const auto kept = first_contact(pair, {.tolerance = tolerance,
                                           .min_separation = min_distance,
                                           .keep_distance = 1 - conservative_rescaling,
                                           .latest = tmax});
    if (!kept) return false;
    toi = std::max(kept->toi, beyond_most);
    if (toi >= kSmallToi) return true;
    const auto touching =
        first_contact(pair, {.tier = Tier::kExact, .min_separation = min_distance, .latest = tmax});
    if (!touching) return false;
    toi = conservative_rescaling * touching->toi;
    return true;
  }
};

}  // namespace warmfront::ipc_toolkit
