#include "record/more_columns.h"

#include <cmath>
#include <cstdio>
#include <set>
#include <tuple>

#include <nlohmann/json.hpp>

#include "record/database.h"
#include "record/sweep_reader.h"

namespace sinerig::record {

namespace {

using Json = nlohmann::json;

const std::set<std::string> known_columns{"dwell",
                                          "tone",
                                          "response",
                                          "input",
                                          "output",
                                          "freq_hz",
                                          "re",
                                          "im",
                                          "var_re",
                                          "cov_re_im",
                                          "var_im",
                                          "dof",
                                          "gain_interval_db",
                                          "phase_interval_deg",
                                          "input_amplitude",
                                          "output_amplitude",
                                          "snr_db",
                                          "distortion",
                                          "drift_per_s",
                                          "samples",
                                          "lost",
                                          "seconds",
                                          "status",
                                          "reason",
                                          "reason_value"};

bool holds_numbers(Database& database, const std::string& column) {
  Statement row{database, "SELECT count(*) FROM point WHERE typeof(\"" + column +
                              "\") IN ('real', 'integer')"};
  return row.step() && row.integer(0) > 0;
}

double number_at(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : 0.0;
}

std::vector<double> numbers(const Json& array) {
  std::vector<double> values;
  for (const Json& each : array) {
    if (!each.is_number()) return {};
    values.push_back(each.get<double>());
  }
  return values;
}

std::vector<std::complex<double>> roots(const Json& array) {
  std::vector<std::complex<double>> values;
  for (const Json& each : array) {
    if (each.is_number()) values.emplace_back(each.get<double>());
    if (each.is_array() && each.size() == 2 && each[0].is_number() && each[1].is_number())
      values.emplace_back(each[0].get<double>(), each[1].get<double>());
  }
  return values;
}

std::vector<std::vector<double>> rows(const Json& array) {
  std::vector<std::vector<double>> values;
  for (const Json& each : array) values.push_back(numbers(each));
  return values;
}

// Nothing where a part is missing or of another length: another program may write such a key.
std::optional<StoredChoe> choe_of(const Json& row) {
  const auto json = row.find("choe");
  if (json == row.end() || !json->is_object()) return {};
  const auto part = [&](const char* key) {
    return json->value(key, Json::array());
  };
  StoredChoe choe{.bands = {},
                  .freq_hz = numbers(part("freq_hz")),
                  .nominal = roots(part("nominal")),
                  .additive = rows(part("additive")),
                  .weight = numbers(part("weight"))};
  const Json bands = part("bands");
  const Json models = part("band_models");
  const std::size_t points = choe.freq_hz.size();
  bool whole = bands.is_array() && models.is_array() && points > 0 &&
               choe.nominal.size() == points && choe.weight.size() == points &&
               bands.size() == models.size() && choe.additive.size() == models.size();
  for (const auto& each : choe.additive) whole = whole && each.size() == points;
  if (!whole) return {};
  for (std::size_t k = 0; k < models.size(); ++k) {
    if (!bands[k].is_object() || !models[k].is_object()) return {};
    choe.bands.push_back({.low_hz = number_at(bands[k], "low_hz"),
                          .high_hz = number_at(bands[k], "high_hz"),
                          .num = numbers(models[k].value("num", Json::array())),
                          .den = numbers(models[k].value("den", Json::array()))});
    if (choe.bands.back().num.empty() || choe.bands.back().den.empty()) return {};
  }
  return choe;
}

std::string text_of(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value.get<double>());
    return text;
  }
  return value.dump();
}

std::string list_text(const Json& array) {
  std::string text;
  for (const Json& each : array) text += (text.empty() ? "" : "  ") + text_of(each);
  return text;
}

// A row as one object: JSON texts opened up, their keys beside the columns.
Json row_object(const Statement& row, const std::vector<std::string>& columns) {
  Json object = Json::object();
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::string value = row.text(static_cast<int>(i));
    if (value.empty()) continue;
    Json parsed = Json::parse(value, nullptr, false);
    if (parsed.is_object()) {
      for (const auto& [key, each] : parsed.items()) object.emplace(key, each);
    } else {
      object[columns[i]] = parsed.is_discarded() ? Json(value) : parsed;
    }
  }
  return object;
}

}  // namespace

void read_more_columns(Database& database, std::vector<StoredResponse>& responses) {
  using Key = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t>;
  std::map<Key, StoredPoint*> points;
  for (StoredResponse& response : responses) {
    for (StoredPoint& point : response.points)
      points[{point.dwell, point.tone, point.input, point.output}] = &point;
  }
  for (const std::string& column : database.columns_of("point")) {
    if (known_columns.contains(column) || !holds_numbers(database, column)) continue;
    Statement rows{database, "SELECT dwell, tone, input, output, \"" + column + "\" FROM point"};
    while (rows.step()) {
      const auto id = [&](int index) {
        return static_cast<std::uint32_t>(rows.integer(index));
      };
      const auto found = points.find({id(0), id(1), id(2), id(3)});
      if (found != points.end()) found->second->more[column] = rows.number(4);
    }
  }
}

std::vector<StoredFit> read_fits(Database& database) {
  if (!database.has_table("fit")) return {};
  const std::vector<std::string> columns = database.columns_of("fit");
  std::vector<StoredFit> fits;
  Statement all{database, "SELECT * FROM fit"};
  while (all.step()) {
    const Json row = row_object(all, columns);
    StoredFit fit{.input = static_cast<std::uint32_t>(number_at(row, "input")),
                  .output = static_cast<std::uint32_t>(number_at(row, "output")),
                  .label = {},
                  .num = numbers(row.value("num", Json::array())),
                  .den = numbers(row.value("den", Json::array())),
                  .delay_s = number_at(row, "delay_s"),
                  .hold_period_s = number_at(row, "hold_period_s"),
                  .path_delay_s = number_at(row, "path_delay_s"),
                  .gain = {},
                  .poles = roots(row.value("poles", Json::array())),
                  .zeros = roots(row.value("zeros", Json::array())),
                  .root_covariance = {},
                  .choe = choe_of(row),
                  .facts = {}};
    if (const auto stored = row.find("root_covariance");
        stored != row.end() && stored->is_object()) {
      fit.reference_hz = number_at(*stored, "reference_hz");
      fit.root_covariance = rows(stored->value("matrix", Json::array()));
    }
    if (fit.num.empty() || fit.den.empty()) continue;
    if (row.contains("gain") && row["gain"].is_number()) fit.gain = number_at(row, "gain");
    if (row.contains("method")) fit.label = text_of(row["method"]);
    fit.facts.emplace_back("numerator", list_text(row["num"]));
    fit.facts.emplace_back("denominator", list_text(row["den"]));
    for (const auto& [key, value] : row.items()) {
      if (value.is_primitive() && key != "input" && key != "output" && key != "id" &&
          !value.is_null())
        fit.facts.emplace_back(key, text_of(value));
    }
    fits.push_back(std::move(fit));
  }
  return fits;
}

}  // namespace sinerig::record
