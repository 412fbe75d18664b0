#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include "config/misspelt.h"
#include "config/toml_nodes.h"

namespace sinerig::config {

namespace {

// Levenshtein distance, for "did you mean".
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0U : 1U);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row[b.size()];
}

std::string nearest(std::string_view word, const std::vector<std::string>& candidates) {
  std::string best;
  std::size_t best_distance = word.size() / 2 + 1;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

std::string suggestion(const std::string& nearest_name) {
  return nearest_name.empty() ? "" : "; did you mean " + nearest_name + "?";
}

// "a.b.c" → "c"
std::string last_word(const std::string& path) {
  return path.substr(path.rfind('.') + 1);
}

// Tells an edited file from the one before: FNV-1a of 64 bits, and the length.
std::string digest_of(const std::string& path) {
  std::ifstream stream{path, std::ios::binary};
  std::uint64_t hash = 0xcbf29ce484222325U;
  std::size_t length = 0;
  for (char each = 0; stream.get(each); ++length) {
    hash = (hash ^ static_cast<unsigned char>(each)) * 0x100000001b3U;
  }
  char text[48];
  std::snprintf(text, sizeof text, "%zu bytes, %016llx", length,
                static_cast<unsigned long long>(hash));
  return text;
}

}  // namespace

RigFile::RigFile(std::string text, std::string name)
    : text_{std::move(text)}, name_{std::move(name)}, document_{std::make_unique<Document>()} {
  try {
    document_->root = toml::parse(text_, name_);
  } catch (const toml::parse_error& error) {
    const auto& at = error.source().begin;
    throw ConfigError(name_ + ":" + std::to_string(at.line) + ":" + std::to_string(at.column) +
                      ": " + std::string{error.description()});
  }
}

RigFile::~RigFile() = default;

std::unique_ptr<RigFile> RigFile::load(const std::string& path) {
  std::ifstream stream{path, std::ios::binary};
  if (!stream) throw ConfigError(path + ": cannot be read; is the path right?");
  std::string text;
  try {
    text.assign(std::istreambuf_iterator<char>{stream}, {});
  } catch (const std::ios_base::failure&) {
    throw ConfigError(path + ": reading it failed; is it a file?");
  }
  return parse(std::move(text), path);
}

std::unique_ptr<RigFile> RigFile::parse(std::string text, std::string name) {
  return std::unique_ptr<RigFile>{new RigFile{std::move(text), std::move(name)}};
}

std::optional<Section> RigFile::find(std::string_view name) {
  read_.insert(std::string{name});
  const toml::node* node = document_->root.get(name);
  if (node == nullptr) return std::nullopt;
  if (!node->is_table()) {
    throw ConfigError(place(name_, node->source()) + std::string{name} +
                      ": must be a section, write [" + std::string{name} + "]");
  }
  return Section{std::string{name}, std::string{name},
                 std::make_shared<Section::Node>(Section::Node{node->as_table()}), *this};
}

Section RigFile::section(std::string_view name) {
  std::optional<Section> section = find(name);
  if (section) return *section;
  for (const auto& [key, node] : document_->root) {
    if (read_.contains(std::string{key.str()}) || !is_misspelt(key.str(), name)) continue;
    throw ConfigError(place(name_, key.source()) + "[" + std::string{key.str()} +
                      "]: unknown section" + suggestion(std::string{name}));
  }
  throw ConfigError(name_ + ": the section [" + std::string{name} + "] is missing");
}

std::vector<Section> RigFile::children(std::string_view parent) {
  const std::optional<Section> section = find(parent);
  if (!section) return {};
  std::vector<std::pair<toml::source_index, Section>> found;
  for (const auto& [key, node] : *section->node_->table) {
    const std::string name = std::string{parent} + "." + std::string{key.str()};
    if (!node.is_table()) {
      throw ConfigError(place(name_, node.source()) + "[" + std::string{parent} + "] " +
                        std::string{key.str()} + ": must be a section, write [" +
                        std::string{parent} + ".NAME]");
    }
    found.emplace_back(
        node.source().begin.line,
        Section{name, std::string{parent} + ".NAME",
                std::make_shared<Section::Node>(Section::Node{node.as_table()}), *this});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Section> children;
  children.reserve(found.size());
  for (auto& [line, child] : found) children.push_back(std::move(child));
  return children;
}

void RigFile::include(const std::string& path) {
  // One file has one name, by whatever link it is reached.
  included_[std::filesystem::weakly_canonical(path).string()] = digest_of(path);
}

void RigFile::refuse_unread() const {
  std::vector<std::string> sections;
  for (const std::string& name : read_) {
    if (name.find('.') == std::string::npos) sections.push_back(name);
  }
  const auto check_table = [&](const auto& self, const toml::table& table,
                               const std::string& path) -> void {
    for (const auto& [key, node] : table) {
      const std::string child =
          path.empty() ? std::string{key.str()} : path + "." + std::string{key.str()};
      if (!read_.contains(child)) {
        std::vector<std::string> siblings;
        for (const std::string& known : known_) siblings.push_back(last_word(known));
        const std::string where = name_ + ":" + std::to_string(key.source().begin.line) + ": ";
        if (path.empty()) {
          throw ConfigError(where + "[" + child + "]: unknown section" +
                            suggestion(nearest(child, sections)));
        }
        throw ConfigError(where + "[" + path + "] " + std::string{key.str()} + ": unknown key" +
                          suggestion(nearest(key.str(), siblings)));
      }
      if (const toml::table* inner = node.as_table()) self(self, *inner, child);
      if (const toml::array* array = node.as_array();
          array != nullptr && array->is_array_of_tables()) {
        std::size_t index = 0;
        for (const toml::node& entry : *array) {
          self(self, *entry.as_table(), child + "[" + std::to_string(++index) + "]");
        }
      }
    }
  };
  check_table(check_table, document_->root, "");
}

}  // namespace sinerig::config
