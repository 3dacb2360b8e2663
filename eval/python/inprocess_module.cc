// Runs and sweeps whose estimators are Python functions: the kind "python:NAME", in addition to built-in
// names and "external:".

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <map>

#include "sextant/base/error.h"
#include "sextant/base/progress.h"
#include "sextant/base/text.h"
#include "sextant/estimator/pipeline.h"
#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/external/external_estimator.h"
#include "sextant/eval/python/array_arguments.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/report/run_summary.h"
#include "sextant/eval/workflow/workflow.h"

namespace py = pybind11;

namespace sextant {
namespace {

/// A Python function that any thread may hold and release.
using Function = std::shared_ptr<const py::object>;

Function held(py::object function) {
  return {new py::object(std::move(function)), [](const py::object* object) {
            const py::gil_scoped_acquire gil;
            delete object;
          }};
}

struct PythonFunction {
  Function call;
  Json options;
  Fingerprint fingerprint;
  bool chooses_points = false;
};

py::array_t<double> columns_of(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<py::ssize_t>(a.size());
  py::array_t<double> out({n, py::ssize_t{2}});
  auto at = out.mutable_unchecked<2>();
  for (py::ssize_t i = 0; i < n; ++i) {
    at(i, 0) = a[static_cast<size_t>(i)];
    at(i, 1) = b[static_cast<size_t>(i)];
  }
  return out;
}

/// Returns (flow_x_px, flow_y_px, inverse_depth_per_m, flow_outlier_share, [(length_px, share)],
/// independent_gaussian), or None.
py::object declared(const std::optional<MeasurementNoise>& noise) {
  if (!noise) return py::none();
  py::list parts;
  for (const auto& part : noise->correlation.parts) parts.append(py::make_tuple(part.length_px, part.share));
  return py::make_tuple(noise->flow_x_px, noise->flow_y_px, noise->inverse_depth_per_m,
                        noise->flow_outlier_share, parts, noise->independent_gaussian);
}

/// Returns the measurements and their declared noise, the complete input of an estimator.
py::tuple arguments_of(const Problem& problem, const StartingPoint& start) {
  const Correspondences& p = problem.points;
  const PinholeCamera& c = problem.camera.left;
  py::array_t<bool> inliers(static_cast<py::ssize_t>(start.inliers.size()));
  std::copy(start.inliers.begin(), start.inliers.end(), inliers.mutable_data());
  return py::make_tuple(py::make_tuple(c.fx, c.fy, c.cx, c.cy, problem.camera.bf), columns_of(p.u, p.v),
                        array_of(p.depth), columns_of(p.flow_u, p.flow_v), array_of(p.depth_curr),
                        array_of(start.T_curr_prev.matrix()), inliers, declared(problem.noise));
}

/// The case and the pair that this thread is solving, for messages.
struct Place {
  const SequenceInfo* info = nullptr;
  uint64_t seed = 0;
  const FramePair* pair = nullptr;

  /// Returns "synthetic s18, seed 0, frame 3, object:2". A body is recognised by its first point, because a
  /// pixel belongs to one body.
  std::string text(const Correspondences& points) const {
    if (pair == nullptr) return "an unknown place";
    std::string body = "ego";
    const auto has = [&](const Correspondences& all) {
      for (size_t i = 0; i < all.size(); ++i)
        if (all.u[i] == points.u[0] && all.v[i] == points.v[0]) return true;
      return false;
    };
    for (const ObjectObservation& object : pair->objects)
      if (points.size() > 0 && has(object.points)) body = object_body(object.instance);
    return fmt::format("{} {}, seed {}, frame {}, {}", info->dataset, info->sequence, seed, pair->curr, body);
  }
};

thread_local Place place;

class PythonEstimator final : public Estimator {
 public:
  PythonEstimator(std::string name, PythonFunction function)
      : name_(std::move(name)), function_(std::move(function)) {}

  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override {
    const py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    const std::string at = place.text(problem.points);
    const auto answer = (*function_.call)(*arguments_of(problem, start), at).cast<py::tuple>();
    try {
      return estimate_of(answer, problem, start);
    } catch (const Error& error) {
      fail("{}; returned for {}", error.what(), at);
    }
  }
  bool chooses_points() const override { return function_.chooses_points; }
  Json options() const override { return function_.options; }

 private:
  /// Converts (status, T_curr_prev, covariance or None, inliers or None, iterations), whose types
  /// estimators.py checks.
  MotionEstimate estimate_of(const py::tuple& answer, const Problem& problem,
                             const StartingPoint& start) const {
    MotionEstimate estimate{.T_curr_prev = start.T_curr_prev, .inliers = start.inliers};
    estimate.status = from_name<Status>(answer[0].cast<std::string>(), "status");
    if (estimate.status != Status::ok) return estimate;
    const std::string of = "estimator " + name_ + ": ";
    estimate.T_curr_prev = rigid_motion_of(answer[1], of + "T_curr_prev");
    if (!answer[2].is_none()) estimate.covariance = covariance_of(answer[2], of + "covariance");
    if (!answer[3].is_none()) {
      const auto n = static_cast<py::ssize_t>(problem.points.size());
      const py::array used = checked_array(answer[3], of + "inliers", {"bool", {n}, fmt::format("({},)", n)});
      const auto* first = static_cast<const unsigned char*>(used.data());
      estimate.inliers.assign(first, first + n);
    }
    estimate.iterations = answer[4].cast<int>();
    estimate.refined_flow_u = problem.points.flow_u;
    estimate.refined_flow_v = problem.points.flow_v;
    return estimate;
  }

  std::string name_;
  PythonFunction function_;
};

/// Functions by name; never destroyed, since the interpreter may end before the program does.
std::map<std::string, PythonFunction>& functions() {
  static auto* const all = new std::map<std::string, PythonFunction>;
  return *all;
}

std::shared_ptr<const CaseEstimator> open_function(const std::string& name, const Json& options) {
  const auto found = functions().find(name);
  if (found == functions().end())
    fail(
        "estimator 'python:{}': no function of that name was given: pass it in the argument estimators of "
        "sextant.sweep()",
        name);
  PythonFunction function = found->second;
  if (!options.empty())
    fail("estimator 'python:{}': takes no options: bind them to the function (functools.partial)", name);
  Fingerprint fingerprint = function.fingerprint;
  return pipeline_case_estimator(name, std::make_shared<PythonEstimator>(name, std::move(function)),
                                 std::move(fingerprint),
                                 [](const SequenceInfo& info, uint64_t seed, const FramePair* pair) {
                                   place = {&info, seed, pair};
                                 });
}

/// Throws Error if a folder contains the results of another version of the function.
void check_same_version(const std::filesystem::path& folder, const Fingerprints& now) {
  if (!std::filesystem::exists(folder / "run.json")) return;
  const Fingerprints before = fingerprints_in(read_run_json(folder), (folder / "run.json").string());
  for (const auto& [label, versions] : now) {
    const auto known = before.find(label);
    if (known == before.end() || known->second == versions) continue;
    fail(
        "{}: holds the records of another version of '{}' ({}); choose another folder, or pass force=True "
        "to replace them",
        folder.string(), label, difference(known->second.front(), versions.front()));
  }
}

/// Prints to standard error, in the format of the program's messages.
void show_message(const char* kind, const std::string& text) {
  print_error(fmt::format("sextant: {}: {}\n", kind, one_line(text)));
}

/// Runs the estimator `python:NAME` with the arguments of sextant.run(); returns the summary as JSON.
std::string run_here(const std::vector<std::string>& sources, const std::string& estimator,
                     const std::string& options, const std::string& noise, const std::string& data_root,
                     double level, int n_seeds, int jobs, const std::string& preset, const std::string& out,
                     bool force, bool quiet) {
  const py::gil_scoped_release others_run;
  const RunOutput output{.out = out, .preset = preset, .data_root = {}, .force = force};
  const RunRequest request{.sources = sources,
                           .data_root = data_root,
                           .estimator = estimator,
                           .procedure = {},
                           .options = options_tree(options, {}),
                           .noise = noise,
                           .level = level,
                           .n_seeds = n_seeds,
                           .jobs = jobs,
                           .quiet = quiet};
  const RunConfig config = run_config(request, output);
  if (!force) check_same_version(out, run_fingerprints(config));
  const WrittenRun folder = run_into_folder(config, output);
  for (const std::string& warning : noise_warnings(request, config)) show_message("warning", warning);
  for (const std::string& warning : folder.warnings) show_message("warning", warning);
  Json summary = summary_json(folder.result.records, find_preset(preset));
  summary["problems"] = Json::array();
  for (const SourceRun& source : folder.result.sources) {
    for (const std::string& problem : source.problems) summary["problems"].push_back(problem);
  }
  return json_line(summary);
}

std::string sweep_here(const std::string& plan, const std::string& name, const std::string& data_root,
                       const std::string& cache, int jobs, const std::string& out, bool force,
                       bool reuse_stale, bool quiet) {
  const py::gil_scoped_release others_run;
  SweepConfig config;
  config.plan = parse_plan(plan, name, data_root);
  config.out = out;
  config.cache = pack_cache(cache);
  config.jobs = jobs;
  config.force = force;
  config.reuse_stale = reuse_stale;
  config.quiet = quiet;
  config.on_message = [](const std::string& line) { show_message("note", line); };
  return json_line(to_json(sweep(config), out));
}

}  // namespace
}  // namespace sextant

PYBIND11_MODULE(_inprocess, inprocess) {
  inprocess.doc() = "Runs and sweeps with estimators of this process.";
  py::module_::import("sextant._core");  // defines Error
  sextant::add_external_estimators();
  sextant::add_estimator_kind("python", "python:NAME", sextant::open_function);
  inprocess.def("set_function", [](const std::string& name, py::object function, const std::string& options,
                                   const std::string& fingerprint, bool chooses_points) {
    sextant::functions()[name] = {sextant::held(std::move(function)), sextant::parse_json(options, name),
                                  sextant::Fingerprint::from(sextant::parse_json(fingerprint, name), name),
                                  chooses_points};
  });
  inprocess.def("forget_function", [](const std::string& name) { sextant::functions().erase(name); });
  inprocess.def("run", sextant::run_here);
  inprocess.def("sweep", sextant::sweep_here);
}
