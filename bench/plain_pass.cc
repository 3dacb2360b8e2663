// usage: plain_pass FILE.jsonl...
//
// Parses every line of the files with simdjson, block by block, and looks at each number and text without
// storing it. This is the least time in which a JSON parser can read records; bench/scale divides the times
// of the commands that read records by it.

#include <simdjson.h>

#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <vector>

namespace {

struct Totals {
  size_t n_lines = 0, n_texts = 0, n_numbers = 0;
  double sum = 0;
};

void look(simdjson::ondemand::value json, Totals& totals) {
  if (json.type() == simdjson::ondemand::json_type::object) {
    for (auto field : json.get_object()) look(field.value(), totals);
  } else if (json.type() == simdjson::ondemand::json_type::string) {
    totals.n_texts += json.get_string().value().empty() ? 0U : 1U;
  } else {
    totals.sum += json.get_double().value();
    ++totals.n_numbers;
  }
}

void read(const char* path, Totals& totals) {
  constexpr size_t block_bytes = size_t{4} << 20U;
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(std::string(path) + ": cannot open");
  std::vector<char> block(block_bytes + simdjson::SIMDJSON_PADDING);
  simdjson::ondemand::parser parser;
  parser.threaded = false;
  for (size_t kept = 0;;) {
    file.read(block.data() + kept, static_cast<std::streamsize>(block_bytes - kept));
    const size_t size = kept + static_cast<size_t>(file.gcount());
    if (size == kept) break;
    size_t whole = size;
    while (whole > 0 && block[whole - 1] != '\n') --whole;
    simdjson::ondemand::document_stream lines = parser.iterate_many(block.data(), whole, block_bytes).value();
    for (auto line : lines) {
      for (auto field : line.get_object()) look(field.value(), totals);
      ++totals.n_lines;
    }
    kept = size - whole;
    std::memmove(block.data(), block.data() + whole, kept);
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Totals totals;
    for (int i = 1; i < argc; ++i) read(argv[i], totals);
    std::printf("%zu lines, %zu texts, %zu numbers, sum %g\n", totals.n_lines, totals.n_texts,
                totals.n_numbers, totals.sum);
    return argc > 1 ? 0 : 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "plain_pass: %s\n", error.what());
    return 2;
  }
}
