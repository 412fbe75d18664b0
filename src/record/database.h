// The few lines of SQLite that the sweep file needs: handles that close themselves, errors that say
// which file and what SQLite said.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

struct sqlite3;
struct sqlite3_stmt;

namespace sinerig::record {

class SweepFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A file that is not to be replaced without being told so.
class FileExists : public SweepFileError {
 public:
  using SweepFileError::SweepFileError;
};

class Database;

// A prepared statement; bind in order, then step.
class Statement {
 public:
  Statement(Database& database, std::string_view sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  // NaN is stored as NULL: SQLite has no NaN.
  template <typename... Values>
  Statement& bind(const Values&... values) {
    reset();
    int index = 0;
    (bind_one(++index, values), ...);
    return *this;
  }

  bool step();  // true while there is a row
  void run();   // step to the end and reset, for another bind

  double number(int column) const;  // NULL reads as NaN
  std::int64_t integer(int column) const;
  std::string text(int column) const;

 private:
  void bind_one(int index, double value);
  void bind_one(int index, std::int64_t value);
  void bind_one(int index, std::string_view value);
  void bind_one(int index, const std::string& value) { bind_one(index, std::string_view{value}); }
  void bind_one(int index, const char* value) { bind_one(index, std::string_view{value}); }
  void bind_one(int index, std::uint16_t value) { bind_one(index, std::int64_t{value}); }
  void bind_one(int index, std::uint32_t value) { bind_one(index, std::int64_t{value}); }
  void bind_one(int index, std::uint64_t value) {
    bind_one(index, static_cast<std::int64_t>(value));
  }
  void bind_one(int index, std::optional<std::uint64_t> value) {
    value ? bind_one(index, *value) : bind_one(index, std::nan(""));
  }
  void check(int code) const;
  void reset() noexcept;

  Database& database_;
  sqlite3_stmt* handle_ = nullptr;
};

class Database {
 public:
  // A file to be read is written to only where a process that was killed left it half written.
  enum class Mode { read, write, create };

  Database(const std::string& path, Mode mode);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void execute(const std::string& sql);  // any number of statements, no results
  std::int64_t pragma(const std::string& name);
  bool has_table(const std::string& name);
  std::vector<std::string> columns_of(const std::string& table);  // none where there is no table
  bool in_transaction() const;

  sqlite3* handle() const { return handle_; }
  [[noreturn]] void fail(const std::string& what) const;

 private:
  void open(int flags);

  std::string path_;
  sqlite3* handle_ = nullptr;
};

}  // namespace sinerig::record
