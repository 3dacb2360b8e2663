// The module sextant._core: noise and records here; trajectories and motions in motion_binding.cc.

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cmath>
#include <cstring>
#include <optional>

#include "sextant/eval/export/export.h"
#include "sextant/eval/python/array_arguments.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/noise/noise.h"

namespace py = pybind11;

namespace sextant {

// Defined in motion_binding.cc.
void bind_trajectories(py::module_& core);
void bind_motions(py::module_& core);

namespace {

/// Arrays of one frame; None for missing ones.
struct FrameArrays {
  py::object depth, flow, backward_flow, mask;
};

/// The number of rows and columns, which all arrays of a frame share.
class FrameSize {
 public:
  py::array check(const py::object& value, const std::string& name, ExpectedArray expected) {
    if (height_ > 0) {
      expected.shape[0] = height_;
      expected.shape[1] = width_;
      expected.in_words = fmt::format("({}, {}{}), as {} has it", height_, width_,
                                      expected.shape.size() > 2 ? ", 2" : "", first_);
    }
    py::array array = checked_array(value, name, expected);
    if (height_ == 0) {
      constexpr py::ssize_t most = 1 << 20;
      if (array.shape(0) > most || array.shape(1) > most)
        fail("{}: expected at most {} rows and columns", name, most);
      height_ = array.shape(0);
      width_ = array.shape(1);
      first_ = name;
    }
    return array;
  }
  int height() const { return static_cast<int>(height_); }
  int width() const { return static_cast<int>(width_); }

 private:
  py::ssize_t height_ = 0, width_ = 0;
  std::string first_;
};

constexpr const char* keep_says =
    "; if these pixels have no measurement, give missing='keep', which leaves them unchanged";

/// Throws Error on negative depths; also on NaN, infinity and 0, which are missing measurements, unless
/// `keep_missing`.
void check_depth(const py::array& depth, bool keep_missing) {
  const std::string negative = places_of<float>(depth, [](float z) { return z < 0; });
  if (!negative.empty()) fail("depth: expected depths above 0 m, got {}", negative);
  if (keep_missing) return;
  const std::string missing = places_of<float>(depth, [](float z) { return !(z > 0 && std::isfinite(z)); });
  if (!missing.empty()) fail("depth: expected finite depths above 0 m, got {}{}", missing, keep_says);
}

void check_flow(const py::array& flow, const std::string& name, bool keep_missing) {
  if (keep_missing) return;
  const std::string missing = places_of<float>(flow, [](float u) { return !std::isfinite(u); });
  if (!missing.empty()) fail("{}: expected finite flow, got {}{}", name, missing, keep_says);
}

template <typename Pixel>
Image<Pixel> image_of(const py::array& array) {
  Image<Pixel> image(static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)));
  std::memcpy(image.data(), array.data(), image.size() * sizeof(Pixel));
  return image;
}

static_assert(sizeof(Flow) == 2 * sizeof(float));

Frame frame_of(const FrameArrays& arrays, int index, bool keep_missing) {
  Frame frame;
  frame.index = index;
  FrameSize size;
  if (!arrays.depth.is_none()) {
    const py::array depth = size.check(arrays.depth, "depth", {"float32", {-1, -1}, "(height, width)"});
    check_depth(depth, keep_missing);
    frame.depth_m = image_of<float>(depth);
  }
  const auto flow_of = [&](const py::object& value, const std::string& name) {
    const py::array flow = size.check(value, name, {"float32", {-1, -1, 2}, "(height, width, 2)"});
    check_flow(flow, name, keep_missing);
    return image_of<Flow>(flow);
  };
  if (!arrays.flow.is_none()) frame.flow = flow_of(arrays.flow, "flow");
  if (!arrays.backward_flow.is_none()) frame.backward_flow = flow_of(arrays.backward_flow, "backward_flow");
  if (!arrays.mask.is_none())
    frame.mask = image_of<uint16_t>(size.check(arrays.mask, "mask", {"uint16", {-1, -1}, "(height, width)"}));
  return frame;
}

template <typename Number, typename Pixel>
py::object array_or_none(const Image<Pixel>& image) {
  return image.empty() ? py::object(py::none()) : py::object(array_of<Number>(image));
}

py::tuple apply(const Noise& noise, const std::array<double, 5>& camera, uint64_t seed,
                const std::string& dataset, const std::string& sequence, int index, const FrameArrays& arrays,
                bool keep_missing) {
  const StereoCamera stereo{{camera[0], camera[1], camera[2], camera[3]}, camera[4]};
  stereo.left.check();
  if (!arrays.depth.is_none()) stereo.check();
  const Frame clean = frame_of(arrays, index, keep_missing);
  NoisyFrame noisy;
  {
    const py::gil_scoped_release others_run;
    noisy = noise.apply(clean, stereo, Draws(seed, dataset, sequence));
  }
  return py::make_tuple(array_or_none<float>(noisy.frame.depth_m), array_or_none<float>(noisy.frame.flow),
                        array_or_none<float>(noisy.frame.backward_flow),
                        array_or_none<uint16_t>(noisy.frame.mask),
                        json_line(noisy.achieved.json(noise.options())));
}

}  // namespace

static void bind_noise(py::module_& core) {
  py::class_<Noise>(core, "Noise")
      .def(py::init([](const std::string& text) { return Noise::parse(text); }))
      .def("options", [](const Noise& noise) { return json_line(noise.options()); })
      .def("name", &Noise::name)
      .def("apply", [](const Noise& noise, const std::array<double, 5>& camera, uint64_t seed,
                       const std::string& dataset, const std::string& sequence, int frame,
                       const py::object& depth, const py::object& flow, const py::object& backward_flow,
                       const py::object& mask, bool keep_missing) {
        return apply(noise, camera, seed, dataset, sequence, frame, {depth, flow, backward_flow, mask},
                     keep_missing);
      });
}

namespace {

/// A column that is being filled; `at` is the address of its next value.
struct Filling {
  py::array values;
  char* at = nullptr;
  DistinctTexts texts{};

  void put(auto value) {
    std::memcpy(at, &value, sizeof value);
    at += sizeof value;
  }
};

/// Returns a list of the columns in their order: (name, array, None) for numbers; (name, indices, texts) for
/// texts, where index -1 is a missing text.
py::list read_columns(const std::string& folder) {
  std::vector<Filling> filling;
  std::vector<RecordColumn> columns;
  {
    std::optional<RecordColumns> records;
    {
      const py::gil_scoped_release others_run;
      records.emplace(folder);
    }
    columns = records->columns();
    for (const RecordColumn& column : columns) {
      filling.push_back({py::array(py::dtype(numpy_type(column.kind)), records->n_rows())});
      filling.back().at = static_cast<char*>(filling.back().values.mutable_data());
    }
    const py::gil_scoped_release others_run;
    records->for_each_row([&](std::span<const RecordValue> row) {
      for (size_t i = 0; i < row.size(); ++i)
        put_numpy(row[i], columns[i].kind, filling[i].texts, [&](auto value) { filling[i].put(value); });
    });
  }
  py::list out;
  for (size_t i = 0; i < columns.size(); ++i) {
    py::object texts = py::none();
    if (columns[i].kind == ColumnKind::text) {
      py::list all;
      for (const Interned& text : filling[i].texts.all) all.append(text.str());
      texts = all;
    }
    out.append(py::make_tuple(columns[i].name, filling[i].values, texts));
  }
  return out;
}

}  // namespace

static void bind_records(py::module_& core) { core.def("read_records", read_columns); }

}  // namespace sextant

PYBIND11_MODULE(_core, core) {
  core.doc() = "Noise, errors, bound and records of Sextant, for the sextant package.";
  py::register_exception<sextant::InternalError>(core, "InternalError", PyExc_RuntimeError);
  py::register_exception<sextant::Error>(core, "Error", PyExc_ValueError);
  core.def(
      "version", [] { return std::string(sextant::version()); },
      "Returns the version of the package and of the program.\n\n>>> sextant.version().count('.')\n2\n");
  core.def(
      "git_commit", [] { return std::string(sextant::git_commit()); },
      "Returns the git commit from which the package was built.\n\n>>> sextant.git_commit() != ''\nTrue\n");
  sextant::bind_noise(core);
  sextant::bind_trajectories(core);
  sextant::bind_motions(core);
  sextant::bind_records(core);
}
