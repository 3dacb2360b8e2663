#include <memory>

#include "sextant/base/options.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/report/table_layout.h"
#include "sextant/eval/report/words.h"

namespace sextant {
namespace {

struct ExplainFlags : CommonFlags {
  std::string word;
};

constexpr size_t line_width = 100;

void explain_words(const ExplainFlags& flags) {
  std::vector<const Word*> words;
  if (flags.word.empty()) {
    for (const Word& word : all_words()) words.push_back(&word);
  } else {
    words = explain(flags.word);
  }
  if (flags.json) {
    Json json = Json::array();
    for (const Word* word : words)
      json.push_back(
          {{"word", word->word}, {"kind", word->kind}, {"meaning", word->meaning}, {"others", word->others}});
    fmt::print("{}", json_text(json));
    return;
  }
  for (const Word* word : words)
    fmt::print("{}\n", wrapped(fmt::format("{} ({}): {}.", word->word, word->kind, word->meaning), line_width,
                               "    "));
}

}  // namespace

void add_explain_command(CLI::App& app) {
  const auto flags = std::make_shared<ExplainFlags>();
  CLI::App* command = app.add_subcommand("explain", "What a word of a table or report means");
  add_value(*command, "word", flags->word, "WORD",
            "The word: coverage, gated, E_t, split_nees, ..; none: all of them");
  command->add_flag("--json", flags->json, "Print as JSON");
  command->footer("Example:\n  sextant explain coverage");
  command->callback([flags] { explain_words(*flags); });
}

}  // namespace sextant
