#include "record/database.h"

#include <cmath>
#include <limits>

#include <sqlite3.h>

namespace sinerig::record {

Database::Database(const std::string& path, Mode mode) : path_{path} {
  open(mode == Mode::read    ? SQLITE_OPEN_READONLY
       : mode == Mode::write ? SQLITE_OPEN_READWRITE
                             : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  if (mode != Mode::read) return;
  // A journal that a killed process left has to be rolled back before anything can be read.
  const int code = sqlite3_exec(handle_, "PRAGMA schema_version", nullptr, nullptr, nullptr);
  if ((code & 0xff) != SQLITE_READONLY) return;
  sqlite3_close_v2(handle_);
  open(SQLITE_OPEN_READWRITE);
}

void Database::open(int flags) {
  if (sqlite3_open_v2(path_.c_str(), &handle_, flags, nullptr) != SQLITE_OK) {
    const std::string reason = handle_ != nullptr ? sqlite3_errmsg(handle_) : "out of memory";
    sqlite3_close(handle_);
    throw SweepFileError(path_ + ": cannot be opened: " + reason);
  }
  sqlite3_busy_timeout(handle_, 5000);
}

Database::~Database() {
  sqlite3_close_v2(handle_);
}

void Database::fail(const std::string& what) const {
  throw SweepFileError(path_ + ": " + what + ": " + sqlite3_errmsg(handle_));
}

void Database::execute(const std::string& sql) {
  if (sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) {
    fail("cannot be written");
  }
}

bool Database::in_transaction() const {
  return sqlite3_get_autocommit(handle_) == 0;
}

std::int64_t Database::pragma(const std::string& name) {
  Statement statement{*this, "PRAGMA " + name};
  return statement.step() ? statement.integer(0) : 0;
}

bool Database::has_table(const std::string& name) {
  Statement found{*this, "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?"};
  found.bind(name);
  return found.step();
}

std::vector<std::string> Database::columns_of(const std::string& table) {
  Statement rows{*this, "SELECT name FROM pragma_table_info(?)"};
  rows.bind(table);
  std::vector<std::string> names;
  while (rows.step()) names.push_back(rows.text(0));
  return names;
}

Statement::Statement(Database& database, std::string_view sql) : database_{database} {
  const int code = sqlite3_prepare_v2(database.handle(), sql.data(), static_cast<int>(sql.size()),
                                      &handle_, nullptr);
  if (code != SQLITE_OK) database_.fail("not a sweep file, or damaged");
}

Statement::~Statement() {
  sqlite3_finalize(handle_);
}

void Statement::check(int code) const {
  if (code != SQLITE_OK) database_.fail("a value cannot be stored");
}

// What a failed step left behind has been said already.
void Statement::reset() noexcept {
  sqlite3_reset(handle_);
}

void Statement::bind_one(int index, double value) {
  check(std::isnan(value) ? sqlite3_bind_null(handle_, index)
                          : sqlite3_bind_double(handle_, index, value));
}

void Statement::bind_one(int index, std::int64_t value) {
  check(sqlite3_bind_int64(handle_, index, value));
}

void Statement::bind_one(int index, std::string_view value) {
  check(sqlite3_bind_text64(handle_, index, value.data(), value.size(), SQLITE_TRANSIENT,
                            SQLITE_UTF8));
}

bool Statement::step() {
  const int code = sqlite3_step(handle_);
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) database_.fail("cannot be read or written");
  return false;
}

void Statement::run() {
  while (step()) {
  }
  check(sqlite3_reset(handle_));
}

double Statement::number(int column) const {
  if (sqlite3_column_type(handle_, column) == SQLITE_NULL) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return sqlite3_column_double(handle_, column);
}

std::int64_t Statement::integer(int column) const {
  return sqlite3_column_int64(handle_, column);
}

std::string Statement::text(int column) const {
  const unsigned char* text = sqlite3_column_text(handle_, column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(handle_, column));
  return text == nullptr ? std::string{} : std::string{reinterpret_cast<const char*>(text), size};
}

}  // namespace sinerig::record
