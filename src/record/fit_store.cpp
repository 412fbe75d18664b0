#include "record/fit_store.h"

#include <algorithm>
#include <vector>

#include "record/database.h"

namespace sinerig::record {

namespace {

constexpr const char* table_sql = R"sql(
CREATE TABLE IF NOT EXISTS fit ( -- models identified from the points, oldest first
  id          INTEGER PRIMARY KEY,
  created_utc TEXT NOT NULL,
  input       INTEGER NOT NULL REFERENCES channel,
  output      INTEGER NOT NULL REFERENCES channel,
  method      TEXT NOT NULL,     -- ml hassul choe
  json        TEXT NOT NULL      -- num, den, delay_s, errors … as `sinerig fit --json` prints it
);
)sql";

constexpr const char* used_columns[] = {"created_utc", "input", "output", "method", "json"};

std::vector<std::string> missing_columns(Database& database) {
  const std::vector<std::string> there = database.columns_of("fit");
  std::vector<std::string> missing;
  for (const char* name : used_columns) {
    if (std::find(there.begin(), there.end(), name) == there.end()) missing.emplace_back(name);
  }
  return missing;
}

bool is_used(const std::string& name) {
  return std::find(std::begin(used_columns), std::end(used_columns), name) !=
         std::end(used_columns);
}

// Columns of another program that want a value, which the fit may have under their name.
std::vector<std::string> demanding_columns(Database& database) {
  Statement columns{database,
                    "SELECT name FROM pragma_table_info('fit') WHERE \"notnull\" AND pk = 0 AND "
                    "dflt_value IS NULL"};
  std::vector<std::string> names;
  while (columns.step()) {
    const std::string name = columns.text(0);
    if (!is_used(name) && name.find_first_of("\"'") == std::string::npos) names.push_back(name);
  }
  return names;
}

}  // namespace

void store_fit(const std::string& path, std::uint32_t input, std::uint32_t output,
               const std::string& method, const std::string& json) {
  Database database{path, Database::Mode::write};
  database.execute("BEGIN IMMEDIATE");
  database.execute(table_sql);
  for (const std::string& name : missing_columns(database))
    database.execute("ALTER TABLE fit ADD COLUMN " + name);
  std::string more_columns;
  std::string more_values;
  for (const std::string& name : demanding_columns(database)) {
    more_columns += ", \"" + name + "\"";
    more_values += ", json_extract(?4, '$.\"" + name + "\"')";
  }
  Statement insert{database, "INSERT INTO fit (input, output, method, json, created_utc" +
                                 more_columns +
                                 ") VALUES (?1, ?2, ?3, ?4, strftime('%Y-%m-%dT%H:%M:%SZ', 'now')" +
                                 more_values + ")"};
  insert.bind(input, output, method, json).run();
  database.execute("COMMIT");
}

std::optional<std::string> last_fit(const std::string& path, std::uint32_t input,
                                    std::uint32_t output) {
  Database database{path, Database::Mode::read};
  if (!missing_columns(database).empty()) return std::nullopt;
  Statement latest{database,
                   "SELECT json FROM fit WHERE input = ? AND output = ? AND method = 'ml' "
                   "ORDER BY rowid DESC LIMIT 1"};
  latest.bind(input, output);
  if (!latest.step()) return std::nullopt;
  return latest.text(0);
}

}  // namespace sinerig::record
