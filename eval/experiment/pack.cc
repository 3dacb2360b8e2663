#include "sextant/eval/experiment/pack.h"

#include <cmath>

#include "sextant/base/byte_stream.h"

namespace sextant {
namespace {

constexpr std::string_view magic = "SEXTPACK";
constexpr size_t digest_bytes = 64;  // hexadecimal
// Of one without points and objects.
constexpr size_t object_bytes = 24;
constexpr size_t pair_bytes = 105;

/// Counts and lengths of a pack have 8 bytes.
class Writer : public ByteWriter {
 public:
  void text(std::string_view text) {
    put(static_cast<uint64_t>(text.size()));
    raw(text);
  }
  void floats(const std::vector<double>& values) {
    for (const double value : values) {
      const auto single = static_cast<float>(value);
      SEXTANT_CHECK(std::isnan(value) || static_cast<double>(single) == value);
      put(single);
    }
  }
};

class Reader : public ByteReader {
 public:
  using ByteReader::ByteReader;

  size_t count(size_t size) { return checked_count(get<uint64_t>(), size); }
  /// Things that follow, of at least `size` bytes each: memory grows with what is there, not with their number.
  template <typename T, typename Get>
  std::vector<T> list(size_t size, const Get& get) {
    std::vector<T> things;
    for (size_t n = count(size); n > 0; --n) things.push_back(get(*this));
    return things;
  }
  std::string_view text() { return raw(count(1)); }
  std::vector<double> floats(size_t n) {
    std::vector<double> values(n);
    for (double& value : values) value = static_cast<double>(get<float>());
    return values;
  }
};

void put_points(const Correspondences& points, Writer& out) {
  out.put(static_cast<uint64_t>(points.size()));
  for (const auto* values :
       {&points.u, &points.v, &points.depth, &points.flow_u, &points.flow_v, &points.depth_curr}) {
    out.floats(*values);
  }
}

Correspondences get_points(Reader& in) {
  const size_t n = in.count(6 * sizeof(float));
  Correspondences points;
  for (auto* values :
       {&points.u, &points.v, &points.depth, &points.flow_u, &points.flow_v, &points.depth_curr}) {
    *values = in.floats(n);
  }
  return points;
}

void put_object(const ObjectObservation& object, Writer& out) {
  out.put(static_cast<int32_t>(object.instance));
  out.put(object.area_fraction);
  out.put(static_cast<int32_t>(object.n_background));
  put_points(object.points, out);
  for (const uint16_t instance : object.instance_prev) out.put(instance);
}

ObjectObservation get_object(Reader& in) {
  ObjectObservation object;
  object.instance = in.get<int32_t>();
  object.area_fraction = in.get<double>();
  object.n_background = in.get<int32_t>();
  object.points = get_points(in);
  object.instance_prev.resize(object.points.size());
  for (uint16_t& instance : object.instance_prev) instance = in.get<uint16_t>();
  return object;
}

void put_pair(const ExtractedPair& extracted, Writer& out) {
  const FramePair& pair = extracted.pair;
  for (const int value : {pair.prev, pair.curr, pair.width, pair.height})
    out.put(static_cast<int32_t>(value));
  const PinholeCamera& left = pair.camera.left;
  for (const double value : {pair.dt_s, left.fx, left.fy, left.cx, left.cy, pair.camera.bf,
                             extracted.decode_ms, extracted.extraction_ms}) {
    out.put(value);
  }
  put_points(pair.background, out);
  out.put(static_cast<uint64_t>(pair.objects.size()));
  for (const ObjectObservation& object : pair.objects) put_object(object, out);
  out.put(static_cast<uint64_t>(pair.lost_instances.size()));
  for (const int instance : pair.lost_instances) out.put(static_cast<int32_t>(instance));
  out.put(static_cast<uint8_t>(extracted.true_flow ? 1 : 0));
  if (!extracted.true_flow) return;
  out.put(static_cast<uint64_t>(extracted.true_flow->samples().size()));
  for (const FlowSamples::Sample& sample : extracted.true_flow->samples()) {
    out.put(static_cast<int32_t>(sample.x));
    out.put(static_cast<int32_t>(sample.y));
    out.put(sample.flow.u);
    out.put(sample.flow.v);
  }
}

FlowSamples::Sample get_sample(Reader& in) {
  FlowSamples::Sample sample;
  sample.x = in.get<int32_t>();
  sample.y = in.get<int32_t>();
  sample.flow.u = in.get<float>();
  sample.flow.v = in.get<float>();
  return sample;
}

ExtractedPair get_pair(Reader& in) {
  ExtractedPair extracted;
  FramePair& pair = extracted.pair;
  for (int* value : {&pair.prev, &pair.curr, &pair.width, &pair.height}) *value = in.get<int32_t>();
  PinholeCamera& left = pair.camera.left;
  for (double* value : {&pair.dt_s, &left.fx, &left.fy, &left.cx, &left.cy, &pair.camera.bf,
                        &extracted.decode_ms, &extracted.extraction_ms}) {
    *value = in.get<double>();
  }
  pair.background = get_points(in);
  pair.objects = in.list<ObjectObservation>(object_bytes, get_object);
  pair.lost_instances = in.list<int>(sizeof(int32_t), [](Reader& r) { return r.get<int32_t>(); });
  if (in.get<uint8_t>() == 0) return extracted;
  extracted.true_flow = FlowSamples(in.list<FlowSamples::Sample>(4 * sizeof(int32_t), get_sample));
  return extracted;
}

}  // namespace

std::string encode_pack(const Pack& pack) {
  Writer pairs;
  pairs.put(static_cast<uint64_t>(pack.pairs.size()));
  for (const ExtractedPair& pair : pack.pairs) put_pair(pair, pairs);
  Writer out;
  out.raw(magic);
  out.put(static_cast<uint32_t>(pack_version));
  out.text(json_line(pack.manifest));
  out.text(pairs.take());
  std::string bytes = out.take();
  bytes += sha256(bytes);
  return bytes;
}

Pack decode_pack(std::string_view bytes, const std::string& name) {
  if (!bytes.starts_with(magic) || bytes.size() < magic.size() + sizeof(uint32_t) + digest_bytes) {
    fail("{}: not a pack", name);
  }
  const std::string_view body = bytes.substr(0, bytes.size() - digest_bytes);
  if (sha256(body) != bytes.substr(body.size())) fail("{}: damaged: its SHA-256 differs", name);
  Reader in(body, name);
  in.raw(magic.size());
  const auto version = in.get<uint32_t>();
  if (version != pack_version) fail("{}: of version {}, expected {}", name, version, pack_version);
  Pack pack;
  pack.manifest = parse_json(in.text(), name + ": manifest");
  Reader pairs(in.text(), name);
  in.expect_end();
  pack.pairs = pairs.list<ExtractedPair>(pair_bytes, get_pair);
  pairs.expect_end();
  return pack;
}

}  // namespace sextant
