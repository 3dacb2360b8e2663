#pragma once

#include <string>

namespace sextant {

/// Path of the file that a FileReader (files.h) of any thread opened last; empty before the first. Memory is asked for in
/// proportion to what files hold, so this is the file that a message about lack of memory names.
std::string last_opened_file();

}  // namespace sextant
