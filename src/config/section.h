// A rig file read with care: typed, bounded getters that remember which keys they were asked for,
// so that afterwards every key nobody asked for is an error with its line.
#pragma once

#include <complex>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace sinerig::config {

// "config/gimbal.toml:12: [sweep] stop_hz = 900: must be below half the loop rate (500 Hz)"
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// What a number may be. The ends belong to it unless open.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool open_min = false;
  bool open_max = false;
  bool or_unlimited = false;  // inf is a value, where the key sets no bound by default

  bool contains(double value) const;
  std::string rule() const;  // "must be above 0 and at most 1"
};

inline constexpr Range any_number{};
inline constexpr Range above_zero{.min = 0.0, .open_min = true};
inline constexpr Range above_zero_or_unlimited{.min = 0.0, .open_min = true, .or_unlimited = true};
inline constexpr Range zero_or_more{.min = 0.0};
inline constexpr Range fraction_of_one{.min = 0.0, .max = 1.0};

class RigFile;

// One table of the file. Getters throw ConfigError; those with a fallback accept a missing key.
class Section {
 public:
  const std::string& name() const { return name_; }

  bool has(std::string_view key) const;

  double number(std::string_view key, Range range) const;
  double number(std::string_view key, Range range, double fallback) const;
  std::int64_t integer(std::string_view key, Range range) const;
  std::int64_t integer(std::string_view key, Range range, std::int64_t fallback) const;
  bool flag(std::string_view key, bool fallback) const;
  std::string text(std::string_view key) const;
  std::string text(std::string_view key, std::string_view fallback) const;

  // What can be named or numbered, a GPIO line say: the name, or the digits of the number.
  std::string name_or_index(std::string_view key) const;

  // One of `options`; the first is the fallback.
  std::string choice(std::string_view key, std::initializer_list<std::string_view> options) const;

  std::vector<double> numbers(std::string_view key, Range range) const;
  std::vector<std::string> texts(std::string_view key) const;
  std::vector<std::vector<double>> rows(std::string_view key, Range range) const;

  // Real numbers and [re, im] pairs.
  std::vector<std::complex<double>> roots(std::string_view key) const;

  // All values of this table and of those in it, as TOML text, by their path: {"sweep.amplitude",
  // "0.1"}. Nobody has to know the keys.
  std::vector<std::pair<std::string, std::string>> values() const;

  // [section.key]; empty where the key is missing.
  std::optional<Section> table(std::string_view key) const;

  // [[section.key]]; empty where the key is missing.
  std::vector<Section> tables(std::string_view key) const;

  // See RigFile::include.
  void include(const std::string& path) const;

  // Throws with this key's place and value.
  [[noreturn]] void refuse(std::string_view key, std::string_view rule) const;

 private:
  friend class RigFile;
  struct Node;
  struct Access;
  Section(std::string name, std::string pattern, std::shared_ptr<const Node> node, RigFile& file);

  std::string name_;     // "sensor.gyro"
  std::string pattern_;  // "sensor.NAME": what the documentation calls it
  std::shared_ptr<const Node> node_;
  RigFile* file_;
};

class RigFile {
 public:
  // Reads and parses; throws ConfigError with line and column.
  static std::unique_ptr<RigFile> load(const std::string& path);
  static std::unique_ptr<RigFile> parse(std::string text, std::string name);
  ~RigFile();
  RigFile(const RigFile&) = delete;
  RigFile& operator=(const RigFile&) = delete;

  const std::string& text() const { return text_; }
  const std::string& name() const { return name_; }

  Section section(std::string_view name);  // throws where it is missing
  std::optional<Section> find(std::string_view name);

  // The tables under `parent` in the order of the file: [sensor.encoder], [sensor.gyro].
  std::vector<Section> children(std::string_view parent);

  // What this file means depends on that one, too: a device profile, a DBC.
  void include(const std::string& path);

  // A digest of each such file, as it was then, by its absolute path.
  const std::map<std::string, std::string>& included() const { return included_; }

  // Throws at the first key or section that nobody has asked for.
  void refuse_unread() const;

  // Every "section.key" asked for so far, present or not.
  const std::set<std::string>& known_keys() const { return known_; }

 private:
  friend class Section;
  struct Document;
  RigFile(std::string text, std::string name);

  std::string text_;
  std::string name_;
  std::unique_ptr<Document> document_;
  std::set<std::string> known_;  // pattern.key
  std::set<std::string> read_;   // name.key and names of sections
  std::map<std::string, std::string> included_;
};

}  // namespace sinerig::config
