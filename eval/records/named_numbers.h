#pragma once

// A few numbers by name, in the order of the names: a map in one piece of memory, 16 bytes a number.

#include <algorithm>
#include <initializer_list>
#include <utility>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/interned.h"

namespace sextant {

class NamedNumbers {
 public:
  using key_type = Interned;
  using mapped_type = double;
  using value_type = std::pair<Interned, double>;
  using iterator = std::vector<value_type>::iterator;
  using const_iterator = std::vector<value_type>::const_iterator;

  NamedNumbers() = default;
  NamedNumbers(std::initializer_list<value_type> numbers) { insert(numbers.begin(), numbers.end()); }
  bool operator==(const NamedNumbers&) const = default;

  const_iterator begin() const { return numbers_.begin(); }
  const_iterator end() const { return numbers_.end(); }
  size_t size() const { return numbers_.size(); }
  bool empty() const { return numbers_.empty(); }
  void clear() { numbers_.clear(); }

  const_iterator find(Interned name) const { return std::ranges::find(numbers_, name, &value_type::first); }
  bool contains(Interned name) const { return find(name) != end(); }
  double at(Interned name) const {
    const auto it = find(name);
    SEXTANT_CHECK(it != end());
    return it->second;
  }
  double& operator[](Interned name) { return emplace(name, 0.0).first->second; }

  /// Leaves a number that is there.
  std::pair<iterator, bool> emplace(Interned name, double number) {
    const auto known = std::ranges::find(numbers_, name, &value_type::first);
    if (known != numbers_.end()) return {known, false};
    const auto is_before = [](const value_type& item, Interned other) { return item.first < other; };
    return {
        numbers_.emplace(std::lower_bound(numbers_.begin(), numbers_.end(), name, is_before), name, number),
        true};
  }
  template <typename Iterator>
  void insert(Iterator first, Iterator last) {
    for (; first != last; ++first) emplace(first->first, first->second);
  }
  /// False where the name does not stand behind all others.
  bool append(Interned name, double number) {
    if (!empty() && !(numbers_.back().first < name)) return false;
    numbers_.emplace_back(name, number);
    return true;
  }

  void erase(Interned name) {
    std::erase_if(numbers_, [&](const value_type& item) { return item.first == name; });
  }
  template <typename Condition>
  friend void erase_if(NamedNumbers& numbers, const Condition& condition) {
    std::erase_if(numbers.numbers_, condition);
  }

 private:
  std::vector<value_type> numbers_;
};

}  // namespace sextant
