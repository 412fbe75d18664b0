#include "record/fit_store.h"

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

}  // namespace

void store_fit(const std::string& path, std::uint32_t input, std::uint32_t output,
               const std::string& method, const std::string& json) {
  Database database{path, Database::Mode::write};
  database.execute(table_sql);
  Statement insert{database,
                   "INSERT INTO fit (created_utc, input, output, method, json) VALUES "
                   "(strftime('%Y-%m-%dT%H:%M:%SZ', 'now'), ?, ?, ?, ?)"};
  insert.bind(input, output, method, json).run();
}

std::optional<std::string> last_fit(const std::string& path, std::uint32_t input,
                                    std::uint32_t output) {
  Database database{path, Database::Mode::read};
  Statement table{database, "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = 'fit'"};
  if (!table.step()) return std::nullopt;
  Statement latest{database,
                   "SELECT json FROM fit WHERE input = ? AND output = ? AND method = 'ml' "
                   "ORDER BY id DESC LIMIT 1"};
  latest.bind(input, output);
  if (!latest.step()) return std::nullopt;
  return latest.text(0);
}

}  // namespace sinerig::record
