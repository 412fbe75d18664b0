#include "config/overrides.h"

#include <sstream>

#include "config/section.h"
#include "config/toml_nodes.h"

namespace sinerig::config {

namespace {

toml::table parsed(const std::string& text, const std::string& name) {
  try {
    return toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    const auto& at = error.source().begin;
    throw ConfigError(name + ":" + std::to_string(at.line) + ":" + std::to_string(at.column) +
                      ": " + std::string{error.description()});
  }
}

// Where a line begins; lines count from 1.
std::size_t start_of_line(const std::string& text, std::size_t line) {
  std::size_t at = 0;
  for (std::size_t i = 1; i < line; ++i) {
    const std::size_t end = text.find('\n', at);
    if (end == std::string::npos) return text.size();
    at = end + 1;
  }
  return at;
}

// toml++ counts columns in characters, from 1.
std::size_t offset_of(const std::string& text, const toml::source_position& position) {
  std::size_t at = start_of_line(text, position.line);
  for (std::size_t column = 1; column < position.column && at < text.size(); ++column) {
    ++at;
    while (at < text.size() && (static_cast<unsigned char>(text[at]) & 0xc0U) == 0x80U) ++at;
  }
  return at;
}

std::string value_at(const std::string& text, const std::string& name, const std::string& path) {
  const toml::table root = parsed(text, name);
  std::ostringstream value;
  value << root.at_path(path);
  return value.str();
}

std::string with_override(const std::string& text, const std::string& name, const std::string& path,
                          const std::string& value) {
  const toml::table root = parsed(text, name);
  const std::size_t dot = path.rfind('.');
  if (dot == std::string::npos) {
    throw ConfigError(name + ": " + path + ": write section.key, such as sweep.amplitude");
  }
  const std::string section = path.substr(0, dot);
  const std::string key = path.substr(dot + 1);
  std::string edited = text;
  if (const auto node = root.at_path(path)) {
    const toml::source_region& region = node.node()->source();
    const std::size_t begin = offset_of(text, region.begin);
    edited.replace(begin, offset_of(text, region.end) - begin, value);
  } else if (const auto table = root.at_path(section)) {
    const std::size_t below = start_of_line(text, table.node()->source().begin.line + 1);
    edited.insert(below,
                  (below > 0 && text[below - 1] != '\n' ? "\n" : "") + key + " = " + value + "\n");
  } else {
    edited += "\n[" + section + "]\n" + key + " = " + value + "\n";
  }
  // The proof of the pudding: the value that a reader of the new text finds.
  const std::string wanted = value_at("value = " + value + "\n", name, "value");
  try {
    if (value_at(edited, name, path) == wanted) return edited;
  } catch (const ConfigError&) {
    // Said below: the place in a text that nobody has written helps nobody.
  }
  throw ConfigError(name + ": " + path + " = " + value +
                    " cannot be put in its place; write the section as [" + section +
                    "] and the key on a line of its own");
}

}  // namespace

std::size_t line_of(const std::string& text, const std::string& name, const std::string& path) {
  const toml::table root = parsed(text, name);
  const auto value = root.at_path(path);
  return value ? value.node()->source().begin.line : 0;
}

std::string with_overrides(std::string text, const std::string& name,
                           const std::vector<Override>& overrides) {
  for (const auto& [path, value] : overrides) text = with_override(text, name, path, value);
  return text;
}

}  // namespace sinerig::config
