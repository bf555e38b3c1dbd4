// SPDX-License-Identifier: Apache-2.0
// warmfront._engine: the engine in this process, for warmfront.Collider. Internal: warmfront/_engine.pyi says
// what it has. A Session is used by one thread at a time, but for stop(); what it gives is immutable.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "client/python/native/answer.h"
#include "client/python/native/contact_hash.h"
#include "client/python/native/errors.h"
#include "client/python/native/reading.h"
#include "client/python/native/session.h"
#include "engine/instructions.h"

namespace py = pybind11;
using warmfront::python::Session;

PYBIND11_MODULE(_engine, module) {
  module.doc() = "The engine in this process. Internal: use warmfront.Collider.";
  warmfront::python::translate_errors();
  warmfront::python::declare_answer(module);
  module.def("instruction_sets", &warmfront::instruction_sets);
  module.def("hash_after", &warmfront::python::hash_after, py::arg("before"), py::arg("kind"),
             py::arg("status"), py::arg("v"), py::arg("toi"), py::arg("multiplicity"), py::arg("stencil"));

  py::class_<warmfront::Question>(module, "Question", "Of a v1.Question.")
      .def(py::init([](const py::object& message) { return warmfront::python::question_of(message); }));
  py::class_<warmfront::python::Submitted, std::shared_ptr<warmfront::python::Submitted>>(
      module, "Submitted", "A question on its way.");
  py::class_<Session, std::shared_ptr<Session>>(module, "Session", "A session in this process.")
      .def(py::init(&Session::create), py::arg("header"), py::arg("positions"), py::arg("faces"),
           py::arg("edges"), py::arg("thickness"), py::arg("filters"), py::arg("threads"))
      .def("ask", &Session::ask, py::arg("question"), py::arg("positions"), py::arg("parts"),
           py::arg("timeout"))
      .def("commit", &Session::commit, py::arg("fraction"), py::arg("timeout"))
      .def("submit", &Session::submit, py::arg("question"), py::arg("positions"), py::arg("parts"))
      .def("submit_commit", &Session::submit_commit, py::arg("fraction"))
      .def("take", &Session::take, py::arg("submitted"))
      .def("change", &Session::change, py::arg("changes"), py::arg("options"))
      .def("change_options", &Session::change_options, py::arg("options"))
      .def("stop", &Session::stop)
      .def_property_readonly("frame", &Session::frame)
      .def_property_readonly("changes", &Session::changes)
      .def("positions", &Session::positions)
      .def("describe", [](const Session& self, const py::object& info) {
        // Into a v1.SessionInfo.
        const warmfront::Scene& scene = self.scene();
        info.attr("vertex_count") = scene.vertex_count();
        info.attr("face_count") = scene.face_count();
        info.attr("edge_count") = scene.edge_count();
        info.attr("lone_edge_count") = scene.lone_edges().size();
        info.attr("body_count") = scene.body_count();
        info.attr("last_frame") = self.frame();
        info.attr("memory_bytes") = self.memory_bytes();
        info.attr("most_thickness") = scene.most_thickness();
        info.attr("world_count") = warmfront::world_count(scene.bodies());
        info.attr("screw_count") = warmfront::screw_count(scene.bodies());
        warmfront::python::tell(self.options(), info.attr("options"));
        warmfront::python::tell(scene.filters(), info.attr("filters"));
      });
}
