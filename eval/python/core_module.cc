#include "sextant/base/error.h"
#include "sextant/eval/python/bindings.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"

namespace py = pybind11;

PYBIND11_MODULE(_core, core) {
  core.doc() = "Noise, errors, bound and records of Sextant, for the package around it.";
  py::register_exception<sextant::InternalError>(core, "InternalError", PyExc_RuntimeError);
  py::register_exception<sextant::Error>(core, "Error", PyExc_ValueError);
  core.def("version", [] { return std::string(sextant::version()); });
  core.def("git_commit", [] { return std::string(sextant::git_commit()); });
  sextant::bind_noise(core);
  sextant::bind_trajectories(core);
  sextant::bind_motions(core);
  sextant::bind_records(core);
}
