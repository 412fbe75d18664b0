// Words, numbers, signs and strings of a DBC text, with the line each is on.
#pragma once

#include <charconv>
#include <stdexcept>
#include <string>
#include <string_view>

#include <system_error>

namespace sinerig::can {

class DbcScanner {
 public:
  DbcScanner(std::string_view text, std::string file_name)
      : text_(text), file_name_(std::move(file_name)) {}

  int line() const noexcept { return line_; }
  bool at_end() { return skip_space(), position_ == text_.size(); }

  [[noreturn]] void refuse(const std::string& what) const { refuse_at(line_, what); }
  [[noreturn]] void refuse_at(int line, const std::string& what) const {
    throw std::runtime_error(file_name_ + ":" + std::to_string(line) + ": " + what);
  }

  // A name or keyword: letters, digits, underscores.
  std::string_view word(const char* what) {
    skip_space();
    const std::size_t start = position_;
    while (position_ < text_.size() && is_word(text_[position_])) ++position_;
    if (position_ == start) refuse("expected " + std::string(what) + ", found " + here());
    return text_.substr(start, position_ - start);
  }

  template <class Number>
  Number number(const char* what) {
    skip_space();
    const char* first = text_.data() + position_;
    const char* last = text_.data() + text_.size();
    if (first != last && *first == '+') ++first;
    Number value{};
    const auto [end, error] = std::from_chars(first, last, value);
    if (error == std::errc::result_out_of_range)
      refuse(std::string(what) + " " + here() + " is out of range");
    if (error != std::errc{}) refuse("expected " + std::string(what) + ", found " + here());
    position_ = static_cast<std::size_t>(end - text_.data());
    return value;
  }

  bool take(char sign) {
    skip_space();
    if (position_ == text_.size() || text_[position_] != sign) return false;
    ++position_;
    return true;
  }

  void expect(char sign, const char* where) {
    if (!take(sign)) refuse(std::string("expected '") + sign + "' " + where + ", found " + here());
  }

  std::string quoted(const char* what) {
    if (!take('"')) refuse("expected " + std::string(what) + " in quotes, found " + here());
    const int first_line = line_;
    std::string content;
    while (position_ < text_.size() && text_[position_] != '"') {
      if (text_[position_] == '\\' && position_ + 1 < text_.size()) ++position_;
      content += text_[position_];
      advance();
    }
    if (position_ == text_.size()) refuse_at(first_line, "the quotes are never closed");
    ++position_;
    return content;
  }

  // Past the next ';' that is not in a string.
  void skip_statement() {
    const int first_line = line_;
    while (!at_end()) {
      if (text_[position_] == '"') {
        quoted("text");
      } else if (take(';')) {
        return;
      } else {
        advance();
      }
    }
    refuse_at(first_line, "the statement that starts here is never closed with ';'");
  }

  void skip_line() {
    while (position_ < text_.size() && text_[position_] != '\n') ++position_;
  }

  // Past this line and the indented or empty ones that follow.
  void skip_indented_block() {
    do {
      skip_line();
      if (position_ < text_.size()) advance();
    } while (position_ < text_.size() && is_space(text_[position_]));
  }

 private:
  static bool is_space(char c) noexcept { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
  static bool is_word(char c) noexcept {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  }

  void advance() noexcept {
    if (text_[position_] == '\n') ++line_;
    ++position_;
  }

  void skip_space() noexcept {
    while (position_ < text_.size() && is_space(text_[position_])) advance();
  }

  std::string here() const {
    if (position_ >= text_.size()) return "the end of the file";
    const std::string_view rest = text_.substr(position_, 20);
    return std::string("'").append(rest.substr(0, rest.find_first_of("\r\n"))).append("'");
  }

  std::string_view text_;
  std::string file_name_;
  std::size_t position_ = 0;
  int line_ = 1;
};

}  // namespace sinerig::can
