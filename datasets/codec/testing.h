#pragma once

// Test helper: the statement throws Error, and its message is one line that holds the given text.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "sextant/base/error.h"

namespace sextant {

template <typename Function>
void expect_error(Function function, const std::string& part) {
  try {
    function();
    ADD_FAILURE() << "no Error, expected one with: " << part;
  } catch (const Error& error) {
    EXPECT_THAT(std::string(error.what()), testing::HasSubstr(part));
    EXPECT_THAT(std::string(error.what()), testing::Not(testing::HasSubstr("\n")));
  }
}

}  // namespace sextant
