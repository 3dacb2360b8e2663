// Throughput of readers of records.jsonl, in bytes per second of one thread, on the committed baseline: our
// scanner (eval/records/record_stream.h), nlohmann's parser and, if it was found at configure time, the
// on-demand parser of simdjson, which fills the same Record from the same list of fields in the same order.
// The instruction set of that parser is chosen at compile time: for any x86-64 it is the portable fallback
// without SIMD. simdjson is used in two ways:
//
//   simdjson_lines   one document per line, as records are defined: a message can name the bad line
//   simdjson_block   all documents of the text at once: faster, but a record that extends over two lines, and
//                    two records in one line, are not noticed

#include <benchmark/benchmark.h>

#include <cstring>

#include "sextant/base/files.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"

#ifdef SEXTANT_SIMDJSON
#include <simdjson.h>
#endif

namespace {

using namespace sextant;

const std::string& text() {
  static const std::string text =
      read_file(std::filesystem::path(SEXTANT_SOURCE) / "results" / "baseline" / "gate" / "records.jsonl");
  return text;
}

void finish(benchmark::State& state, const std::vector<Record>& records) {
  if (records != parse_records(text(), "records")) state.SkipWithError("other records");
  state.SetBytesProcessed(state.iterations() * static_cast<int64_t>(text().size()));
}

void scanner(benchmark::State& state) {
  std::vector<Record> records;
  for (auto _ : state) benchmark::DoNotOptimize(records = parse_records(text(), "records"));
  finish(state, records);
}
BENCHMARK(scanner)->Unit(benchmark::kMillisecond);

void nlohmann_pass(benchmark::State& state) {
  std::vector<Record> records;
  for (auto _ : state) {
    records.clear();
    for (size_t begin = 0; begin < text().size();) {
      const size_t end = text().find('\n', begin);
      const std::string_view line = std::string_view(text()).substr(begin, end - begin);
      records.push_back(record_from_json(parse_json(line, "records"), "records"));
      begin = end + 1;
    }
  }
  finish(state, records);
}
BENCHMARK(nlohmann_pass)->Unit(benchmark::kMillisecond);

#ifdef SEXTANT_SIMDJSON
/// Reads the fields of a record in the order of the file, which must be that of visit_fields().
class SimdjsonReader {
 public:
  explicit SimdjsonReader(simdjson::ondemand::object object)
      : object_(object), at_(object_.begin().value()), end_(object_.end().value()) {
    look();
    int64_t schema = 0;
    take_field("schema", schema);
  }

  template <typename T, typename... Rule>
  void field(const char* name, T& value, const Rule&... rule) {
    take_field(name, value);
    if (!(rule.allows(value) && ...)) throw simdjson::simdjson_error(simdjson::INCORRECT_TYPE);
  }
  template <typename T>
  void only_if(bool is_there, const char* name, T& value, const char*) {
    if (is_there) field(name, value);
  }
  void unless_empty(const char* name, Interned& value, const internal::FieldRule<std::string_view>& rule) {
    if (key_ == name) field(name, value, rule);
  }

 private:
  void look() {
    if (!(at_ != end_)) return;
    if (const auto error = (*at_).get(field_)) throw simdjson::simdjson_error(error);
    key_ = field_.unescaped_key();
  }

  template <typename T>
  void take_field(const char* name, T& value) {
    if (key_ != name) throw simdjson::simdjson_error(simdjson::NO_SUCH_FIELD);
    take(field_.value(), value);
    ++at_;
    look();
  }

  template <typename T>
  static void take(simdjson::ondemand::value json, T& value) {
    if constexpr (std::is_enum_v<T>) {
      if (internal::from_text(json.get_string().value(), value) != nullptr)
        throw simdjson::simdjson_error(simdjson::INCORRECT_TYPE);
    } else if constexpr (std::is_same_v<T, Record::Numbers>) {
      for (auto item : json.get_object()) {
        const Interned key = item.unescaped_key().value();
        if (!value.append(key, item.value().get_double().value()))
          throw simdjson::simdjson_error(simdjson::INCORRECT_TYPE);
      }
    } else if constexpr (std::is_same_v<T, Interned>) {
      value = json.get_string().value();
    } else if constexpr (std::is_same_v<T, double>) {
      value = json.get_double();
    } else if constexpr (std::is_same_v<T, uint64_t>) {
      value = json.get_uint64();
    } else {
      value = static_cast<T>(json.get_int64().value());
    }
  }

  simdjson::ondemand::object object_;
  simdjson::ondemand::object_iterator at_, end_;
  simdjson::ondemand::field field_;
  std::string_view key_;
};

Record read_document(simdjson::ondemand::object object) {
  Record record;
  SimdjsonReader reader(object);
  internal::visit_fields(record, reader);
  return record;
}

void simdjson_lines(benchmark::State& state) {
  simdjson::ondemand::parser parser;
  std::vector<Record> records;
  for (auto _ : state) {
    const simdjson::padded_string padded(text());  // the file as it was read has no room behind it
    records.clear();
    for (size_t begin = 0; begin < padded.size();) {
      const char* line = padded.data() + begin;
      const size_t left = padded.size() - begin;
      const auto size = static_cast<size_t>(static_cast<const char*>(std::memchr(line, '\n', left)) - line);
      simdjson::ondemand::document document =
          parser.iterate(simdjson::padded_string_view(line, size, left + simdjson::SIMDJSON_PADDING)).value();
      records.push_back(read_document(document.get_object().value()));
      if (!document.current_location().error()) throw simdjson::simdjson_error(simdjson::TAPE_ERROR);
      begin += size + 1;
    }
  }
  finish(state, records);
}
BENCHMARK(simdjson_lines)->Unit(benchmark::kMillisecond);

void simdjson_block(benchmark::State& state) {
  simdjson::ondemand::parser parser;
  parser.threaded = false;
  std::vector<Record> records;
  for (auto _ : state) {
    const simdjson::padded_string padded(text());
    records.clear();
    simdjson::ondemand::document_stream documents = parser.iterate_many(padded).value();
    for (auto document : documents) records.push_back(read_document(document.get_object().value()));
  }
  finish(state, records);
}
BENCHMARK(simdjson_block)->Unit(benchmark::kMillisecond);
#endif

}  // namespace
