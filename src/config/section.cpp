#include "config/section.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <utility>

#include "config/misspelt.h"
#include "config/toml_nodes.h"

namespace sinerig::config {

namespace {

std::string number_text(double value) {
  std::ostringstream text;
  text.precision(10);
  text << value;
  return text.str();
}

const char* kind_of(const toml::node& node) {
  if (node.is_table()) return "a table";
  if (node.is_array()) return "an array";
  if (node.is_string()) return "a string";
  if (node.is_boolean()) return "true or false";
  if (node.is_number()) return "a number";
  return "a date or time";
}

// As short as it reads back the same: 0.2, not 0.20000000000000001.
std::string value_text(const toml::node& node) {
  if (const auto* number = node.as_floating_point()) {
    char text[40];
    const auto end = std::to_chars(text, text + sizeof text, number->get());
    return {text, end.ptr};
  }
  if (const toml::array* array = node.as_array()) {
    std::string text;
    for (const toml::node& entry : *array) text += (text.empty() ? "" : ", ") + value_text(entry);
    return "[" + text + "]";
  }
  std::ostringstream text;
  text << toml::node_view<const toml::node>{node};
  return text.str();
}

}  // namespace

bool Range::contains(double value) const {
  if (std::isnan(value) || (std::isinf(value) && !or_unlimited)) return false;
  const bool above = open_min ? value > min : value >= min;
  const bool below = open_max ? value < max : value <= max;
  return above && below;
}

std::string Range::rule() const {
  const std::string low = (open_min ? "above " : "at least ") + number_text(min);
  const std::string high = (open_max ? "below " : "at most ") + number_text(max);
  if (std::isinf(min) && std::isinf(max)) return "must be a finite number";
  if (std::isinf(max)) return "must be " + low;
  if (std::isinf(min)) return "must be " + high;
  return "must be " + low + " and " + high;
}

// A key that has to be there, marked as read.
struct Section::Access {
  static const toml::node& require(const Section& section, std::string_view key,
                                   std::string_view rule);
  static void refuse_misspelt(const Section& section, std::string_view key);
  static const toml::array& require_array(const Section& section, std::string_view key,
                                          std::string_view rule);
  static std::vector<double> numbers(const Section& section, std::string_view key,
                                     const toml::array& array, Range range);
};

Section::Section(std::string name, std::string pattern, std::shared_ptr<const Node> node,
                 RigFile& file)
    : name_{std::move(name)}, pattern_{std::move(pattern)}, node_{std::move(node)}, file_{&file} {
  file_->read_.insert(name_);
}

// What is missing may be there under a name that nobody will ask for.
void Section::Access::refuse_misspelt(const Section& section, std::string_view key) {
  for (const auto& [other, node] : *section.node_->table) {
    const std::string word{other.str()};
    if (section.file_->read_.contains(section.name_ + "." + word) || !is_misspelt(word, key))
      continue;
    throw ConfigError(place(section.file_->name_, other.source()) + "[" + section.name_ + "] " +
                      word + ": unknown key; did you mean " + std::string{key} + "?");
  }
}

const toml::node& Section::Access::require(const Section& section, std::string_view key,
                                           std::string_view rule) {
  if (!section.has(key)) {
    refuse_misspelt(section, key);
    section.refuse(key, "is missing; it " + std::string{rule});
  }
  section.file_->read_.insert(section.name_ + "." + std::string{key});
  return *section.node_->table->get(key);
}

const toml::array& Section::Access::require_array(const Section& section, std::string_view key,
                                                  std::string_view rule) {
  const toml::array* array = require(section, key, rule).as_array();
  if (array == nullptr) section.refuse(key, rule);
  return *array;
}

bool Section::has(std::string_view key) const {
  file_->known_.insert(pattern_ + "." + std::string{key});
  return node_->table->get(key) != nullptr;
}

void Section::include(const std::string& path) const {
  file_->include(path);
}

void Section::refuse(std::string_view key, std::string_view rule) const {
  const toml::node* node = node_->table->get(key);
  if (node == nullptr) {
    throw ConfigError(place(file_->name_, node_->table->source()) + "[" + name_ + "] " +
                      std::string{key} + ": " + std::string{rule});
  }
  throw ConfigError(place(file_->name_, node->source()) + "[" + name_ + "] " + std::string{key} +
                    " = " + value_text(*node) + ": " + std::string{rule});
}

double Section::number(std::string_view key, Range range) const {
  const toml::node& node = Access::require(*this, key, range.rule());
  const std::optional<double> value = node.value<double>();
  if (!node.is_number() || !value)
    refuse(key, std::string{"must be a number, is "} + kind_of(node));
  if (!range.contains(*value)) refuse(key, range.rule());
  return *value;
}

double Section::number(std::string_view key, Range range, double fallback) const {
  return has(key) ? number(key, range) : fallback;
}

std::int64_t Section::integer(std::string_view key, Range range) const {
  const double value = number(key, range);
  if (value != std::round(value)) refuse(key, "must be a whole number");
  return static_cast<std::int64_t>(value);
}

std::int64_t Section::integer(std::string_view key, Range range, std::int64_t fallback) const {
  return has(key) ? integer(key, range) : fallback;
}

bool Section::flag(std::string_view key, bool fallback) const {
  if (!has(key)) return fallback;
  const toml::node& node = Access::require(*this, key, "");
  if (!node.is_boolean()) refuse(key, std::string{"must be true or false, is "} + kind_of(node));
  return *node.value<bool>();
}

std::string Section::text(std::string_view key) const {
  const toml::node& node = Access::require(*this, key, "must be a string");
  if (!node.is_string()) refuse(key, std::string{"must be a string, is "} + kind_of(node));
  return *node.value<std::string>();
}

std::string Section::name_or_index(std::string_view key) const {
  constexpr std::string_view rule = "must be a name in quotes or a whole number";
  const toml::node& node = Access::require(*this, key, rule);
  if (node.is_string()) return text(key);
  if (!node.is_integer()) refuse(key, rule);
  return std::to_string(integer(key, {.min = 0.0, .max = 1e6}));
}

std::string Section::text(std::string_view key, std::string_view fallback) const {
  return has(key) ? text(key) : std::string{fallback};
}

std::string Section::choice(std::string_view key,
                            std::initializer_list<std::string_view> options) const {
  std::string value = text(key, *options.begin());
  if (std::find(options.begin(), options.end(), value) != options.end()) return value;
  std::string rule = "must be one of";
  for (const std::string_view option : options) rule += " \"" + std::string{option} + "\"";
  refuse(key, rule);
}

std::vector<double> Section::Access::numbers(const Section& section, std::string_view key,
                                             const toml::array& array, Range range) {
  std::vector<double> numbers;
  for (const toml::node& entry : array) {
    const std::optional<double> value = entry.value<double>();
    if (!entry.is_number() || !value) section.refuse(key, "must hold numbers only");
    if (!range.contains(*value)) section.refuse(key, "every entry " + range.rule());
    numbers.push_back(*value);
  }
  return numbers;
}

std::vector<double> Section::numbers(std::string_view key, Range range) const {
  return Access::numbers(*this, key,
                         Access::require_array(*this, key, "must be an array of numbers"), range);
}

std::vector<std::vector<double>> Section::rows(std::string_view key, Range range) const {
  constexpr const char* rule = "must be an array of arrays of numbers";
  std::vector<std::vector<double>> rows;
  for (const toml::node& element : Access::require_array(*this, key, rule)) {
    const toml::array* row = element.as_array();
    if (row == nullptr) refuse(key, rule);
    rows.push_back(Access::numbers(*this, key, *row, range));
  }
  return rows;
}

std::vector<std::string> Section::texts(std::string_view key) const {
  const toml::array& array = Access::require_array(*this, key, "must be an array of strings");
  std::vector<std::string> texts;
  for (const toml::node& entry : array) {
    if (!entry.is_string()) refuse(key, "must hold strings only");
    texts.push_back(*entry.value<std::string>());
  }
  return texts;
}

std::vector<std::complex<double>> Section::roots(std::string_view key) const {
  if (!has(key)) return {};
  constexpr const char* rule = "must be an array of numbers and [re, im] pairs (rad/s)";
  const toml::array& array = Access::require_array(*this, key, rule);
  std::vector<std::complex<double>> roots;
  for (const toml::node& entry : array) {
    const toml::array* pair = entry.as_array();
    if (pair == nullptr) {
      if (!entry.is_number()) refuse(key, rule);
      roots.emplace_back(*entry.value<double>());
      continue;
    }
    if (pair->size() != 2 || !pair->get(0)->is_number() || !pair->get(1)->is_number()) {
      refuse(key, rule);
    }
    roots.emplace_back(*pair->get(0)->value<double>(), *pair->get(1)->value<double>());
  }
  return roots;
}

std::vector<std::pair<std::string, std::string>> Section::values() const {
  std::vector<std::pair<std::string, std::string>> all;
  const auto collect = [&](const auto& self, const toml::table& table,
                           const std::string& path) -> void {
    for (const auto& [key, node] : table) {
      const std::string name = path + std::string{key.str()};
      file_->read_.insert(name_ + "." + name);
      if (const toml::table* inner = node.as_table()) {
        self(self, *inner, name + ".");
      } else {
        all.emplace_back(name, value_text(node));
      }
    }
  };
  collect(collect, *node_->table, "");
  return all;
}

std::optional<Section> Section::table(std::string_view key) const {
  if (!has(key)) return std::nullopt;
  const toml::node& node = Access::require(*this, key, "");
  if (!node.is_table()) refuse(key, std::string{"must be a section, is "} + kind_of(node));
  return Section{name_ + "." + std::string{key}, pattern_ + "." + std::string{key},
                 std::make_shared<Node>(Node{node.as_table()}), *file_};
}

std::vector<Section> Section::tables(std::string_view key) const {
  if (!has(key)) return {};
  const toml::array& array = Access::require_array(*this, key, "must be an array of tables");
  std::vector<Section> sections;
  for (const toml::node& entry : array) {
    if (!entry.is_table()) refuse(key, "must be an array of tables");
    const std::string child =
        name_ + "." + std::string{key} + "[" + std::to_string(sections.size() + 1) + "]";
    sections.push_back(Section{child, pattern_ + "." + std::string{key},
                               std::make_shared<Node>(Node{entry.as_table()}), *file_});
  }
  return sections;
}

}  // namespace sinerig::config
