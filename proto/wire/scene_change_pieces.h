// SPDX-License-Identifier: Apache-2.0
// Changes of the scene that are larger than a message: cut into pieces, and put together again. Thread-safe.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "engine/result.h"
#include "warmfront/v1/session.pb.h"

namespace warmfront::wire {

/// The arrays of a change, in an order of their own for each kind of change; none of a kind without any.
std::vector<std::string*> arrays_of(v1::SceneChange& change);

/// A change of the kind of `change`, without anything in it.
v1::SceneChange piece_of(const v1::SceneChange& change);

/// Appends a piece, a change with `continues`, to the change that it goes on with. kInvalidArgument, with a
/// message that begins with `where`, for a piece of another kind of change, or with more in it than arrays.
Status append_piece(v1::SceneChange& to, v1::SceneChange&& piece, const std::string& where);

/// Calls `send` with the messages of StreamChangeScene that are this request, none with more than about
/// `chunk` bytes of arrays; stops, and returns false, where `send` does. The request's arrays are moved out.
template <class Send>
bool send_pieces(v1::ChangeSceneRequest&& request, std::size_t chunk, Send send) {
  google::protobuf::RepeatedPtrField<v1::SceneChange> changes;
  changes.Swap(request.mutable_changes());
  if (!send(request)) return false;  // all but these
  for (v1::SceneChange& change : changes) {
    std::vector<std::string> arrays;
    for (std::string* array : arrays_of(change)) arrays.push_back(std::exchange(*array, {}));
    v1::ChangeSceneRequest next;
    *next.add_changes() = change;
    if (!send(next)) return false;
    for (std::size_t k = 0; k < arrays.size(); ++k) {
      for (std::size_t at = 0; at < arrays[k].size(); at += chunk) {
        v1::ChangeSceneRequest more;
        v1::SceneChange& piece = *more.add_changes();
        piece = piece_of(change);
        piece.set_continues(true);
        arrays_of(piece)[k]->assign(arrays[k], at, chunk);
        if (!send(more)) return false;
      }
    }
  }
  return true;
}

}  // namespace warmfront::wire
