// Why a sweep is not even begun.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace sinerig {

// A plan that can't be run: the message says what, `section` and `key` say which entry of the rig
// file to change.
class PlanRefused : public std::invalid_argument {
 public:
  PlanRefused(std::string section, std::string key, const std::string& what)
      : std::invalid_argument{what}, section_{std::move(section)}, key_{std::move(key)} {}
  const std::string& section() const { return section_; }
  const std::string& key() const { return key_; }

 private:
  std::string section_;
  std::string key_;
};

// A figure for its message, six digits.
std::string number(double value);

}  // namespace sinerig
