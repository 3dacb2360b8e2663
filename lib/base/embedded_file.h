#pragma once

// Text files compiled into the program by sextant_embed() (cmake/SextantEmbed.cmake).

#include <string_view>

namespace sextant {

struct EmbeddedFile {
  std::string_view name;
  std::string_view text;
};

}  // namespace sextant
