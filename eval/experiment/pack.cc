#include "sextant/eval/experiment/pack.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <set>
#include <thread>

#include "sextant/base/byte_stream.h"
#include "sextant/base/error.h"
#include "sextant/base/file_lock.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/machine.h"
#include "sextant/base/new_file.h"
#include "sextant/base/progress.h"
#include "sextant/eval/experiment/run.h"

namespace sextant {
namespace {

constexpr const char* tag_name = "CACHEDIR.TAG";
constexpr const char* tag_text =
    "Signature: 8a477f597d28d172789f06886806bc55\n# Packs of sextant: `sextant cache prune` removes them.\n";

/// Returns true if load() may have written a file of this name: SHA-256 and `extension`, possibly followed by
/// the suffix of a temporary name.
bool has_cache_name(const fs::path& path, std::string_view extension) {
  constexpr size_t n_digits = 64;
  const std::string name = path.filename().string();
  const size_t n = name.find_first_not_of("0123456789abcdef");
  const std::string_view rest = n == n_digits ? std::string_view(name).substr(n) : std::string_view();
  return extension.ends_with(".tmp") ? rest.starts_with(extension) : rest == extension;
}

int64_t change_time(const fs::path& path, std::error_code& error) {
  return static_cast<int64_t>(fs::last_write_time(path, error).time_since_epoch().count());
}

/// Returns the request: everything that determines the pairs besides the bytes of the inputs.
Json request_of(const SourceSpec& source, const Sequence& sequence, const ExtractionOptions& options,
                const Noise& masks) {
  const SequenceInfo& info = sequence.info();
  const PinholeCamera& left = info.camera.left;
  std::error_code ignored;
  const fs::path path =
      fs::exists(source.path, ignored) ? fs::absolute(source.path).lexically_normal() : fs::path(source.path);
  Json request = {{"version", pack_version},
                  {"adapter", source.adapter},
                  {"path", path.string()},
                  {"sequence", info.sequence},
                  {"frames", {info.first_frame, info.last_frame}},
                  {"camera", {left.fx, left.fy, left.cx, left.cy, info.camera.bf}},
                  {"rate_hz", info.rate_hz},
                  {"source_options", source.options},
                  {"provenance", info.provenance},
                  {"extraction", write_options(options)}};
  if (!masks.none()) request["mask_noise"] = masks.options();
  return request;
}

/// Returns the SHA-256 of the request, without the location of the data but with the contents of the inputs.
std::string content_id(Json request, const std::map<std::string, InputLog::Entry>& inputs) {
  request.erase("path");
  std::set<std::string> hashes;
  for (const auto& [path, entry] : inputs) {
    hashes.insert(fs::path(path).filename().string() + " " + entry.sha256);
  }
  request["inputs"] = hashes;
  return sha256(json_line(request));
}

Json dated_inputs(const std::map<std::string, InputLog::Entry>& inputs) {
  Json json = Json::object();
  for (const auto& [path, entry] : inputs) {
    std::error_code error;
    json[path] = {{"bytes", entry.bytes}, {"sha256", entry.sha256}, {"changed", change_time(path, error)}};
  }
  return json;
}

/// Content of a link file: the request, the cache file that answers it, and the inputs of that file.
struct Link {
  std::string content;
  std::string source;
  std::map<std::string, InputLog::Entry> inputs;
};

/// Returns nullopt if the file does not exist, is unreadable, or of another version; or if an input has
/// changed.
std::optional<Link> read_link(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return std::nullopt;
  try {
    const Json json = read_json(path);
    Link link{json.at("content"), json.at("source"), {}};
    if (json.at("request").at("version") != pack_version) return std::nullopt;
    for (const auto& item : json.at("inputs").items()) {
      const uint64_t bytes = item.value().at("bytes");
      const std::string hash = item.value().at("sha256");
      if (fs::file_size(item.key(), error) != bytes || error) return std::nullopt;
      if (change_time(item.key(), error) != item.value().at("changed").get<int64_t>() &&
          sha256(read_file(item.key())) != hash) {
        return std::nullopt;
      }
      link.inputs[item.key()] = {bytes, hash};
    }
    return link;
  } catch (const Json::exception&) {
    return std::nullopt;  // not a file of this cache
  } catch (const Error&) {
    return std::nullopt;  // damaged
  }
}

std::optional<std::vector<ExtractedPair>> read_pack(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return std::nullopt;
  try {
    return decode_pack(read_file(path, records_file), path.string()).pairs;
  } catch (const Error&) {
    return std::nullopt;  // damaged: computed again
  }
}

std::vector<ExtractedPair> read_all(const Sequence& sequence, const ExtractionOptions& options,
                                    const Noise& masks, int jobs, bool quiet) {
  const SequenceInfo& info = sequence.info();
  PairReader reader(sequence, options, masks, jobs);
  Progress progress("packing " + info.sequence, info.last_frame - info.first_frame, quiet);
  std::vector<ExtractedPair> pairs;
  for (std::vector<ExtractedPair> window = reader.next(); !window.empty(); window = reader.next()) {
    progress.advance(static_cast<int>(window.size()));
    std::ranges::move(window, std::back_inserter(pairs));
  }
  return pairs;
}

std::optional<PackCache::Packed> find_pack(const fs::path& folder, const fs::path& link_path) {
  std::optional<Link> link = read_link(link_path);
  if (!link) return std::nullopt;
  const fs::path file = folder / (link->content + ".pack");
  auto pairs = read_pack(file);
  if (!pairs) return std::nullopt;
  return PackCache::Packed{std::move(*pairs), std::move(link->inputs), file, true};
}

/// Waits until no other process computes the cache file of `link_path`. After ten minutes it is computed a
/// second time: the other process may be gone with its host, and of two equal files the last one stays.
class Making {
 public:
  Making(const fs::path& link_path, bool quiet) : file_(link_path.string() + ".making") {
    std::string holder;
    for (int tenths = 0; tenths < 6000; ++tenths) {
      lock_ = FileLock::take(file_, &holder);
      if (lock_) return;
      if (tenths == 20 && !quiet)
        print_error(fmt::format("waiting for the correspondence cache, which {} fills\n", holder));
      check_interrupt();
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
  ~Making() {
    std::error_code ignored;
    if (lock_) fs::remove(file_, ignored);
  }
  Making(const Making&) = delete;
  Making& operator=(const Making&) = delete;

 private:
  fs::path file_;
  std::optional<FileLock> lock_;
};

/// Returns the files of the cache with names of 64 hexadecimal digits and `extension`, without links.
std::vector<fs::path> files_of(const fs::path& folder, std::string_view extension) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.is_regular_file(error) && !entry.is_symlink(error) && has_cache_name(entry.path(), extension))
      files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

/// Marks the folder as a cache (https://bford.info/cachedir) unless it contains other files, which backups
/// must not skip.
void mark_as_cache(const fs::path& folder) {
  const fs::path tag = folder / tag_name;
  std::error_code error;
  if (fs::exists(fs::symlink_status(tag, error))) return;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const bool is_own = has_cache_name(entry.path(), ".pack") || has_cache_name(entry.path(), ".json") ||
                        has_cache_name(entry.path(), ".json.making");
    if (!is_own) return;
  }
  write_file(tag, tag_text);
}

void expect_mark(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) return;
  const fs::path tag = folder / tag_name;
  if (fs::is_regular_file(fs::symlink_status(tag, error)) && read_file(tag) == tag_text) return;
  fail(
      "{}: does not contain Sextant's {}, which marks a cache, so nothing was removed: expected the folder "
      "of a cache",
      folder.string(), tag_name);
}

/// Removes files left by processes that were killed while they computed a cache file. While another process
/// computes one, nothing is removed, because its temporary file looks like the others. Returns the number of
/// bytes freed.
uint64_t remove_left_over(const fs::path& folder) {
  std::error_code error;
  // listed before the locks are taken: whoever writes one of these now holds a lock now
  std::vector<fs::path> left;
  for (const char* kind : {".pack.tmp", ".json.tmp"})
    std::ranges::move(files_of(folder, kind), std::back_inserter(left));
  bool is_in_use = false;
  for (const fs::path& file : files_of(folder, ".json.making")) {
    const std::optional<FileLock> lock = FileLock::take(file);
    is_in_use = is_in_use || !lock;
    if (lock) fs::remove(file, error);
  }
  uint64_t freed = 0;
  if (is_in_use) return freed;
  for (const fs::path& file : left) {
    const uint64_t bytes = fs::file_size(file, error);
    if (fs::remove(file, error)) freed += bytes;
  }
  return freed;
}

}  // namespace

fs::path default_cache_folder() {
  const fs::path root = cache_root();
  return root.empty() ? temporary_folder() / fmt::format("sextant-packs-{}", ::geteuid()) : root / "packs";
}

PackCache::Packed PackCache::load(const SourceSpec& source, const Sequence& sequence,
                                  const ExtractionOptions& options, const Noise& noise, int jobs,
                                  bool quiet) const {
  const Noise masks = noise.only_masks();
  const Json request = request_of(source, sequence, options, masks);
  const fs::path link_path = folder_ / (sha256(json_line(request)) + ".json");
  check_private_folder(folder_);
  if (std::optional<Packed> found = find_pack(folder_, link_path)) return std::move(*found);
  make_private_folder(folder_);
  mark_as_cache(folder_);
  // If many processes start with one cache, one of them computes the file and the others wait for it.
  const Making making(link_path, quiet);
  if (std::optional<Packed> found = find_pack(folder_, link_path)) return std::move(*found);
  Packed packed{.pairs = read_all(sequence, options, masks, jobs, quiet),
                .inputs = sequence.inputs().entries()};
  const std::string content = content_id(request, packed.inputs);
  packed.file = folder_ / (content + ".pack");
  Json manifest = request;
  manifest.erase("path");
  write_file(packed.file, encode_pack({manifest, packed.pairs}));
  const Json link = {{"source", source.text},
                     {"request", request},
                     {"content", content},
                     {"inputs", dated_inputs(packed.inputs)}};
  write_file(link_path, json_text(link));
  return packed;
}

std::vector<PackCache::Entry> PackCache::list() const {
  check_private_folder(folder_);
  std::map<fs::path, Entry> by_file;
  for (const fs::path& file : files_of(folder_, ".pack")) {
    Entry& entry = by_file[file];
    std::error_code error;
    entry.file = file;
    entry.bytes = fs::file_size(file, error);
    if (const auto pairs = read_pack(file)) entry.n_pairs = static_cast<int>(pairs->size());
  }
  for (const fs::path& file : files_of(folder_, ".json")) {
    const std::optional<Link> link = read_link(file);
    if (!link) continue;
    const auto it = by_file.find(folder_ / (link->content + ".pack"));
    if (it == by_file.end() || it->second.n_pairs == 0) continue;
    it->second.source = link->source;
    it->second.valid = true;
  }
  std::vector<Entry> entries;
  for (const auto& [file, entry] : by_file) entries.push_back(entry);
  std::ranges::stable_sort(entries, {}, [](const Entry& e) { return std::pair(e.source.empty(), e.source); });
  return entries;
}

uint64_t PackCache::prune(bool all) const {
  check_private_folder(folder_);
  expect_mark(folder_);
  uint64_t freed = remove_left_over(folder_);
  std::error_code error;
  for (const Entry& entry : list()) {
    if (entry.valid && !all) continue;
    if (fs::remove(entry.file, error)) freed += entry.bytes;
  }
  for (const fs::path& file : files_of(folder_, ".json")) {
    const std::optional<Link> link = all ? std::nullopt : read_link(file);
    if (link && fs::exists(folder_ / (link->content + ".pack"), error)) continue;
    const uint64_t bytes = fs::file_size(file, error);
    if (fs::remove(file, error)) freed += bytes;
  }
  return freed;
}

namespace {

constexpr std::string_view magic = "SEXTPACK";
constexpr size_t digest_bytes = 64;  // hexadecimal
// Encoded sizes, in bytes, of an object and of a pair without points.
constexpr size_t object_bytes = 24;
constexpr size_t pair_bytes = 105;

/// Counts and lengths in a cache file have 8 bytes.
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
  /// Reads a list of items of at least `size` bytes each: memory grows with the bytes that are present, not
  /// with the declared number.
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
    fail("{}: is not a file of the correspondence cache", name);
  }
  const std::string_view body = bytes.substr(0, bytes.size() - digest_bytes);
  if (sha256(body) != bytes.substr(body.size()))
    fail("{}: is damaged: its SHA-256 is not the stored one", name);
  Reader in(body, name);
  in.raw(magic.size());
  const auto version = in.get<uint32_t>();
  if (version != pack_version) fail("{}: has version {}, expected {}", name, version, pack_version);
  Pack pack;
  pack.manifest = parse_json(in.text(), name + ": manifest");
  Reader pairs(in.text(), name);
  in.expect_end();
  pack.pairs = pairs.list<ExtractedPair>(pair_bytes, get_pair);
  pairs.expect_end();
  return pack;
}

PackCache pack_cache(const std::string& folder) {
  return PackCache(folder.empty() ? default_cache_folder() : fs::path(folder));
}

PackCache::Packed pack_source(const PackCache& cache, SourceSpec source, const Json& options, int jobs,
                              bool quiet) {
  const ResolvedOptions resolved = resolve_options(options);
  source.add_options(resolved.source);
  const std::unique_ptr<Sequence> sequence = open_source(source);
  check_runnable(source, *sequence);
  return cache.load(source, *sequence, resolved.extraction, Noise(), jobs, quiet);
}

}  // namespace sextant
