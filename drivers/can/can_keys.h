// The keys of one CAN channel: those of the rig file laid over those of a device profile, each
// remembering which file it is in, so that messages and relative paths are right.
#pragma once

#include <cstdint>
#include <exception>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/section.h"

namespace sinerig::can {

class Keys {
 public:
  Keys(config::Section section, std::string folder)
      : base_{std::move(section)}, base_folder_{std::move(folder)} {}
  Keys(config::Section over, std::string over_folder, config::Section base, std::string folder)
      : over_{std::move(over)},
        over_folder_{std::move(over_folder)},
        base_{std::move(base)},
        base_folder_{std::move(folder)} {}

  bool has(std::string_view key) const { return (over_ && over_->has(key)) || base_.has(key); }

  // The section that holds `key`: the rig's if it does, else the profile's.
  const config::Section& at(std::string_view key) const {
    return over_ && over_->has(key) ? *over_ : base_;
  }
  const std::string& folder_of(std::string_view key) const {
    return over_ && over_->has(key) ? over_folder_ : base_folder_;
  }

  double number(std::string_view key, config::Range range, double fallback) const {
    return at(key).number(key, range, fallback);
  }
  std::int64_t integer(std::string_view key, config::Range range) const {
    return at(key).integer(key, range);
  }
  std::int64_t integer(std::string_view key, config::Range range, std::int64_t fallback) const {
    return at(key).integer(key, range, fallback);
  }
  std::vector<Keys> tables(std::string_view key) const {
    std::vector<Keys> tables;
    for (const config::Section& table : at(key).tables(key))
      tables.emplace_back(table, folder_of(key));
    return tables;
  }
  // Both, the profile's first: what a profile's channel needs is not lost by a list in the rig
  // file.
  std::vector<Keys> joined_tables(std::string_view key) const {
    std::vector<Keys> tables;
    for (const config::Section& table : base_.tables(key)) tables.emplace_back(table, base_folder_);
    if (!over_) return tables;
    for (const config::Section& table : over_->tables(key))
      tables.emplace_back(table, over_folder_);
    return tables;
  }
  // The profile's section, or the only one; the rig's above it, where there is one.
  const config::Section& base() const { return base_; }
  const std::optional<config::Section>& over() const { return over_; }

  [[noreturn]] void refuse(std::string_view key, std::string_view rule) const {
    at(key).refuse(key, rule);
  }

 private:
  std::optional<config::Section> over_;
  std::string over_folder_;
  config::Section base_;
  std::string base_folder_;
};

// Calls `action`, and tells what it refuses at the key that it is about: config::ConfigError.
template <class Action>
decltype(auto) at_key(const Keys& keys, std::string_view key, Action action) {
  try {
    return action();
  } catch (const config::ConfigError&) {
    throw;
  } catch (const std::exception& refused) {
    keys.refuse(key, refused.what());
  }
}

}  // namespace sinerig::can
