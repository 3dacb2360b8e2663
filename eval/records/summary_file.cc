#include "sextant/eval/records/summary_file.h"

#include "sextant/base/byte_stream.h"
#include "sextant/base/error.h"
#include "sextant/base/json.h"
#include "sextant/metrics/definitions.h"

namespace sextant {
namespace {

constexpr int schema = 1;
constexpr const char* kind = "case summaries";
constexpr size_t digest_bytes = 8;
constexpr size_t longest_header = 4096;

Json compared_errors() {
  Json names = Json::array();
  for (const MetricDefinition* metric : metrics_for(compared)) names.push_back(metric->name);
  return names;
}

}  // namespace

bool has_results(const std::filesystem::path& folder) {
  std::error_code ignored;
  return std::filesystem::exists(folder / "records.jsonl", ignored) ||
         std::filesystem::exists(folder / summary_file_name, ignored);
}

void check_keeps_records(const std::filesystem::path& records) {
  std::error_code ignored;
  if (std::filesystem::exists(records, ignored) || !has_results(records.parent_path())) return;
  fail("{}: is not there: the sweep kept summaries (\"keep\": \"summary\"), which only `sextant report` reads",
       records.string());
}

SummaryWriter::SummaryWriter(const std::filesystem::path& path, uint64_t n_cases) : file_(path) {
  file_.append(json_line({{"sextant", kind}, {"schema", schema}, {"cases", n_cases}, {"errors", compared_errors()}}) +
               "\n");
}

void SummaryWriter::append(uint64_t number, std::string_view bytes) {
  ByteWriter block;
  block.varint(number);
  block.text(bytes);
  block.raw(sha256(bytes).substr(0, digest_bytes));
  file_.append(block.take());
}

void SummaryWriter::close(std::string_view noise) {
  ByteWriter block;
  block.text(noise);
  block.raw(sha256(noise).substr(0, digest_bytes));
  file_.append(block.take());
  file_.close();
}

SummaryReader::SummaryReader(const std::filesystem::path& path) : name_(path.string()) {
  // Says what is wrong with a path, and how large the file is.
  left_bytes_ = FileReader(path, recording_file).size();
  file_.open(path, std::ios::binary);
  std::string line;
  char byte = 0;
  while (line.size() < longest_header && file_.get(byte) && byte != '\n') line += byte;
  if (!file_ || byte != '\n' || !line.starts_with("{\"sextant\":")) fail("{}: not a file of case summaries", name_);
  left_bytes_ -= std::min<uint64_t>(left_bytes_, line.size() + 1);
  const Json header = parse_json(line, name_);
  if (json_member<std::string>(header, "sextant", name_) != kind) fail("{}: not a file of case summaries", name_);
  if (const int found = json_member<int>(header, "schema", name_); found != schema)
    fail("{}: schema {}, but this program reads schema {}", name_, found, schema);
  if (const Json errors = json_list(header, "errors", name_); errors != compared_errors()) {
    fail("{}: sums up the errors {}, but this program compares {}; sweep again", name_, json_line(errors),
         json_line(compared_errors()));
  }
  n_cases_ = json_member<uint64_t>(header, "cases", name_);
}

void SummaryReader::cut_off() const { fail("{}: cut off after {} of {} cases", name_, n_read_, n_cases_); }

std::string SummaryReader::take(uint64_t n) {
  if (n > left_bytes_) cut_off();
  std::string bytes(n, '\0');
  if (!file_.read(bytes.data(), static_cast<std::streamsize>(n))) cut_off();
  left_bytes_ -= n;
  return bytes;
}

uint64_t SummaryReader::varint() {
  std::string bytes;
  do {
    bytes += take(1);
  } while ((static_cast<unsigned char>(bytes.back()) & 0x80U) != 0 && bytes.size() < 10);
  return ByteReader(bytes, name_).varint();
}

std::string SummaryReader::checked(const std::string& what) {
  std::string bytes = take(varint());
  if (take(digest_bytes) != sha256(bytes).substr(0, digest_bytes)) fail("{}: {}: damaged: its SHA-256 differs", name_, what);
  return bytes;
}

std::optional<SummaryReader::Block> SummaryReader::next() {
  if (is_at_end_) return std::nullopt;
  if (n_read_ == n_cases_) {
    noise_ = checked("noise");
    is_at_end_ = true;
    if (left_bytes_ > 0) fail("{}: has more than {} cases", name_, n_cases_);
    return std::nullopt;
  }
  Block block;
  block.number = varint();
  block.bytes = checked(fmt::format("case {}", block.number));
  if (last_ && block.number <= *last_) fail("{}: case {} stands after case {}", name_, block.number, *last_);
  last_ = block.number;
  ++n_read_;
  return block;
}

void for_each_summary(const std::filesystem::path& path, const std::function<void(const CaseSummary&)>& visit) {
  SummaryReader reader(path);
  while (const auto block = reader.next())
    visit(decode_case_summary(block->bytes, fmt::format("{}: case {}", path.string(), block->number)));
}

}  // namespace sextant
