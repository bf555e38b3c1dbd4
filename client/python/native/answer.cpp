// SPDX-License-Identifier: Apache-2.0
#include "client/python/native/answer.h"

#include <pybind11/stl.h>

#include <string_view>
#include <vector>

#include "engine/statistics.h"

namespace warmfront::python {
namespace py = pybind11;
namespace {

/// A read-only array on memory of `owner`, C-contiguous, of numbers of so many bytes. Its strides are given,
/// because this pybind11 cannot read the size of a type of numpy 2.
py::array view(const py::dtype& type, std::size_t bytes, std::vector<py::ssize_t> shape, const void* data,
               py::handle owner) {
  // numpy makes an array of its own where there is nothing to look at.
  static const char nothing[64] = {};
  std::vector<py::ssize_t> strides(shape.size());
  auto stride = static_cast<py::ssize_t>(bytes);
  for (std::size_t axis = shape.size(); axis-- > 0;) {
    strides[axis] = stride;
    stride *= shape[axis];
  }
  py::array array(type, std::move(shape), std::move(strides), data != nullptr ? data : nothing, owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

// Looked up once: a step of a small scene takes little longer than finding a type by its name.
template <class T>
const py::dtype& type_of() {
  static const auto* type = new py::dtype(py::dtype::of<T>());  // for the life of the process
  return *type;
}

template <class T, class Column>
py::array column(const Column& values, py::handle owner) {
  return view(type_of<T>(), sizeof(T), {static_cast<py::ssize_t>(values.size())}, values.data(), owner);
}
template <class T, class Column>
py::array rows(const Column& values, py::handle owner) {
  constexpr auto kEach = static_cast<py::ssize_t>(sizeof(typename Column::value_type) / sizeof(T));
  return view(type_of<T>(), sizeof(T), {static_cast<py::ssize_t>(values.size()), kEach}, values.data(),
              owner);
}

py::object optional_float(const std::optional<double>& value) {
  if (!value) return py::none();
  return py::float_(*value);
}

/// A string that is made once for the life of the process, with its hash.
#define WARMFRONT_KEY(name)                                         \
  [] {                                                              \
    static PyObject* const kept = PyUnicode_InternFromString(name); \
    return py::handle(kept);                                        \
  }()
template <class Value>
[[gnu::always_inline]] inline void set(const py::dict& to, py::handle key, const Value& value) {
  if (PyDict_SetItem(to.ptr(), key.ptr(), value.ptr()) != 0) throw py::error_already_set();
}

/// What a step costs with everything deformable, as v1.AllDeformable.
struct AllDeformable {
  StepStatistics statistics;
  std::size_t frame_bytes;
  std::size_t positions_bytes;
};

}  // namespace

py::tuple columns_of(const Answer& answer, py::handle owner) {
  const client::ContactTable& table = answer.contacts;
  const ContactFields& fields = answer.fields;
  const py::object none = py::none();
  const auto asked = [&](bool wanted, auto make) -> py::object { return wanted ? py::object(make()) : none; };
  return py::make_tuple(
      column<std::uint8_t>(table.kind, owner), column<std::uint8_t>(table.status, owner),
      answer.edge_faces ? rows<std::uint32_t>(table.edge_faces, owner)
                        : rows<std::uint32_t>(table.vertices, owner),
      column<double>(table.toi, owner),
      asked(fields.weights, [&] { return rows<double>(table.weights, owner); }),
      asked(fields.normal, [&] { return rows<double>(table.normal, owner); }),
      asked(fields.points,
            [&] {
              return view(type_of<double>(), sizeof(double),
                          {static_cast<py::ssize_t>(table.points.size()), 2, 3}, table.points.data(), owner);
            }),
      asked(fields.direction, [&] { return rows<double>(table.direction, owner); }),
      asked(fields.squared_distance, [&] { return column<double>(table.squared_distance, owner); }),
      asked(fields.closest, [&] { return column<std::uint8_t>(table.closest, owner); }),
      asked(answer.reduced, [&] { return column<std::uint32_t>(table.multiplicity, owner); }),
      asked(answer.reduced, [&] { return column<std::uint8_t>(table.stencil, owner); }));
}

void declare_answer(py::module_& module) {
  py::class_<StepStatistics>(module, "StepStatistics", "As v1.StepStatistics.")
      // All at once, into the dicts of warmfront.StageTimes and StepCounts.
      .def("fill",
           [](const StepStatistics& self, py::dict ms, py::dict counts) {
             set(ms, WARMFRONT_KEY("total"), py::float_(self.ms.total));
             set(ms, WARMFRONT_KEY("refit"), py::float_(self.ms.refit));
             set(ms, WARMFRONT_KEY("front"), py::float_(self.ms.front));
             set(ms, WARMFRONT_KEY("elementary"), py::float_(self.ms.elementary));
             set(ms, WARMFRONT_KEY("adjacent"), py::float_(self.ms.adjacent));
#define WARMFRONT_FILL(name) set(counts, WARMFRONT_KEY(#name), py::int_(self.counts.name));
             WARMFRONT_STEP_COUNTS(WARMFRONT_FILL)
#undef WARMFRONT_FILL
           })
      // The contract's numbers begin with UNSPECIFIED.
      .def_property_readonly(
          "front_state", [](const StepStatistics& self) { return static_cast<int>(self.front_state) + 1; });
  py::class_<AllDeformable>(module, "AllDeformable", "As v1.AllDeformable.")
      .def_readonly("statistics", &AllDeformable::statistics)
      .def_readonly("frame_bytes", &AllDeformable::frame_bytes)
      .def_readonly("positions_bytes", &AllDeformable::positions_bytes);

  py::class_<Answer, std::shared_ptr<Answer>>(module, "Answer", "Reads as a v1.StepSummary.")
      .def_readonly("frame", &Answer::frame)
      .def_readonly("vf", &Answer::vf)
      .def_readonly("ee", &Answer::ee)
      .def_readonly("ve", &Answer::ve)
      .def_readonly("vv", &Answer::vv)
      .def_readonly("ef", &Answer::ef)
      .def_readonly("vh", &Answer::vh)
      .def_readonly("possible", &Answer::possible)
      .def_readonly("overlaps_at_start", &Answer::overlaps_at_start)
      .def_property_readonly("queue_ms", [](const Answer&) { return 0.0; })
      .def_property_readonly("earliest_toi",
                             [](const Answer& self) { return optional_float(self.earliest_toi); })
      .def("HasField",
           [](const Answer& self, std::string_view name) {
             return name == "earliest_toi" ? self.earliest_toi.has_value() : self.all_deformable.has_value();
           })
      .def_readonly("statistics", &Answer::statistics)
      .def_property_readonly("all_deformable",
                             [](const Answer& self) {
                               return AllDeformable{self.all_deformable.value().statistics, self.frame_bytes,
                                                    self.positions_bytes};
                             })
      .def("columns", [](const py::object& self) { return columns_of(self.cast<const Answer&>(), self); })
      .def("distances",
           [](const py::object& self) {
             return column<double>(self.cast<const Answer&>().vertex_distances, self);
           })
      .def("worlds",
           [](const py::object& self) {
             const auto& answer = self.cast<const Answer&>();
             return py::make_tuple(column<std::uint32_t>(answer.worlds, self),
                                   column<double>(answer.world_tois, self));
           })
      .def("has_worlds", [](const Answer& self) { return !self.worlds.empty(); })
      .def("commit", [](const Answer& self) {
        const CommitResult& commit = self.commit.value();
        return py::make_tuple(commit.vf, commit.ee, commit.possible, optional_float(commit.earliest_toi),
                              commit.vh);
      });
}

}  // namespace warmfront::python
