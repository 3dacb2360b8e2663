#pragma once

// Test helper: hostile texts that must remain text on their way through a figure.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "sextant/base/files.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

/// Texts with commands; executing any of them would create the file `planted`.
inline std::vector<std::string> hostile_texts(const std::filesystem::path& planted) {
  const std::string command = "touch " + planted.string();
  return {"`" + command + "`",
          "$(" + command + ")",
          "'.system('" + command + "').'",
          "\".system(\"" + command + "\").\"",
          "''`" + command + "`''",
          "x'\nsystem \"" + command + "\"\n#",
          "x\n!" + command + "\nx",
          "x\\\n!" + command,
          "< " + command,
          "<" + command,
          "| " + command,
          "|" + command,
          "@planted",
          "100 % of %s %d %n %%",
          "{/Times=40 a_b^c&{d}~e}",
          "}{",
          "a\\",
          "\\",
          "a,b;\"c\" 'd'",
          "<b>&amp;</b><script>",
          "<![CDATA[ ]]></title>]]]>",
          "\x1b[2J\x07",
          "no \xff\xc0 UTF-8 \uFFFE",
          "# comment",
          "  blanks  "};
}

/// Expects that all figures are drawn as well-formed XML, and that no command was executed.
inline void expect_drawn(const std::vector<Figure>& figures, const std::filesystem::path& planted) {
  ASSERT_FALSE(figures.empty());
  const OutputFiles files = draw(figures, 2);
  EXPECT_FALSE(std::filesystem::exists(planted));
  const std::filesystem::path svg = planted.string() + ".svg";
  for (const auto& [name, bytes] : files) {
    if (!name.ends_with(".svg")) continue;
    write_file(svg, bytes);
    EXPECT_EQ(std::system(("xmllint --noout '" + svg.string() + "'").c_str()), 0) << name;
    std::filesystem::remove(svg);
  }
}

}  // namespace sextant
