#pragma once

// expect_error() of base/testing.h.

#include "sextant/base/testing.h"
