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

void store_fit(const std::string& path, const StoredFit& fit) {
  Database database{path, Database::Mode::write};
  database.execute(table_sql);
  Statement insert{database,
                   "INSERT INTO fit (created_utc, input, output, method, json) VALUES "
                   "(strftime('%Y-%m-%dT%H:%M:%SZ', 'now'), ?, ?, ?, ?)"};
  insert.bind(fit.input, fit.output, fit.method, fit.json).run();
}

std::vector<StoredFit> read_fits(const std::string& path) {
  Database database{path, Database::Mode::read};
  std::vector<StoredFit> fits;
  Statement exists{database, "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = 'fit'"};
  if (!exists.step()) return fits;
  Statement rows{database, "SELECT created_utc, input, output, method, json FROM fit ORDER BY id"};
  while (rows.step()) {
    fits.push_back({.created_utc = rows.text(0),
                    .input = static_cast<std::uint32_t>(rows.integer(1)),
                    .output = static_cast<std::uint32_t>(rows.integer(2)),
                    .method = rows.text(3),
                    .json = rows.text(4)});
  }
  return fits;
}

}  // namespace sinerig::record
