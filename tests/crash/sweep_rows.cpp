#include "crash/sweep_rows.h"

#include <filesystem>
#include <vector>

#include "record/database.h"
#include "record/unfinished_run.h"

namespace sinerig::test {

namespace {

namespace fs = std::filesystem;
using record::Database;
using record::Statement;

// Opening a log recovers it, which is for the program under test to do: a copy is read.
class Copy {
 public:
  explicit Copy(const std::string& path) : path_{path + "-copy"} {
    for (const char* suffix : {"", "-wal", "-journal"}) {
      if (fs::exists(path + suffix)) {
        fs::copy_file(path + suffix, path_ + suffix, fs::copy_options::overwrite_existing);
      }
    }
  }
  ~Copy() {
    std::error_code ignored;
    for (const char* suffix : {"", "-wal", "-shm", "-journal"}) fs::remove(path_ + suffix, ignored);
  }
  Copy(const Copy&) = delete;
  Copy& operator=(const Copy&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// Every column as SQLite writes it so that it reads back the same, with its table's name.
std::set<std::string> quoted_rows(Database& database, const std::string& table,
                                  const std::string& where) {
  std::string columns;
  Statement names{database, "SELECT name FROM pragma_table_info('" + table + "')"};
  while (names.step()) {
    columns += (columns.empty() ? "" : " || ',' || ") + ("quote(" + names.text(0) + ")");
  }
  std::set<std::string> rows;
  Statement all{database, "SELECT " + columns + " FROM " + table + where};
  while (all.step()) rows.insert(table + ":" + all.text(0));
  return rows;
}

}  // namespace

SweepRows rows_of(const std::string& path, std::uint32_t before) {
  SweepRows found;
  if (!fs::exists(path)) return found;
  const Copy copy{path};
  Database database{copy.path(), Database::Mode::write};
  Statement check{database, "PRAGMA integrity_check"};
  while (check.step()) found.integrity += check.text(0);
  Statement plan{database, "SELECT count(*) FROM sqlite_master WHERE name = 'dwell'"};
  found.begun = plan.step() && plan.integer(0) == 1;
  if (!found.begun) return found;
  const record::UnfinishedRun run = record::read_unfinished(copy.path());
  found.outcome = run.stored.fact("outcome");
  found.finished = run.finished.dwells;
  found.dwells = static_cast<std::uint32_t>(run.stored.plan.dwells.size());
  found.parts = static_cast<std::uint32_t>(run.stored.parts.size());
  Statement stopped{database, "SELECT count(*) FROM point WHERE status = 'stopped'"};
  if (stopped.step()) found.stopped = static_cast<std::uint32_t>(stopped.integer(0));
  const std::string where =
      " WHERE dwell < " + std::to_string(std::min<std::uint32_t>(found.finished, before));
  found.points = quoted_rows(database, "point", where);
  found.rows = found.points;
  for (const char* table : {"timing", "block", "lesson"}) {
    found.rows.merge(quoted_rows(database, table, where));
  }
  return found;
}

}  // namespace sinerig::test
