// SPDX-License-Identifier: Apache-2.0
// A triangle falls through another: exits with 0 if that is three contacts, and the plug's headers compile.
#include <cstdio>
#include <memory>

#include "client/ipc_toolkit/mesh_candidates.h"
#include "engine/eigen.h"

int main() {
  using namespace warmfront;
  VertexMatrix<double> from(6, 3);
  from << 0, 0, 0, 1, 0, 0, 0, 1, 0, .25, .25, 1, 1.25, .25, 1, .25, 1.25, 1;
  VertexMatrix<double> to = from;
  to.bottomRows(3).col(2).setConstant(-1);
  FaceMatrix faces(2, 3);
  faces << 0, 1, 2, 3, 4, 5;
  auto scene = std::make_shared<const Scene>(Scene::create(describe(from, faces)).value());
  Collider collider =
      Collider::create(std::move(scene), positions_of(from), {}, std::make_shared<Workers>()).value();
  const std::size_t contacts = collider.step(positions_of(to)).value().contacts.size();
  std::printf("%zu contacts\n", contacts);
  return contacts == 3 ? 0 : 1;
}
