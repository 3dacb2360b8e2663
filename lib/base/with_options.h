#pragma once

// What a class made from options has: it keeps them, checked, and tells them for provenance.

#include "sextant/base/options.h"

namespace sextant {

/// `Interface` declares `virtual Json options() const`.
template <typename Interface, typename Options>
class WithOptions : public Interface {
 public:
  explicit WithOptions(const Options& options) : options_(options) { options_.check(); }
  Json options() const override { return write_options(options_); }

 protected:
  Options options_;
};

}  // namespace sextant
