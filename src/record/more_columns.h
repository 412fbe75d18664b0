// What a sweep file holds beyond the values that the reader knows by name: figures of a point, and
// the models fitted to a response.
#pragma once

#include <complex>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace sinerig::record {

class Database;
struct StoredResponse;

// The intermediates of a fit by Choe's method, on the grid freq_hz.
struct StoredChoe {
  struct Band {
    double low_hz = 0.0;
    double high_hz = 0.0;
    std::vector<double> num;  // of its model, descending powers of s
    std::vector<double> den;
  };
  std::vector<Band> bands;
  std::vector<double> freq_hz;
  std::vector<std::complex<double>> nominal;  // G_nom
  std::vector<std::vector<double>> additive;  // |G_k − G_nom|, one row per band
  std::vector<double> weight;                 // |W_a|
};

// A model of one response, from the table `fit`.
struct StoredFit {
  std::uint32_t input = 0;
  std::uint32_t output = 0;
  std::string label;        // the method where the file says it
  std::vector<double> num;  // descending powers of s
  std::vector<double> den;  // descending powers of s
  double delay_s = 0.0;
  double hold_period_s = 0.0;  // of the zero-order hold in front of it, 0 = none
  double path_delay_s = 0.0;   // of the measuring path, in the points but not in the model
  std::optional<double> gain;  // of zeros and poles, where the file holds it
  std::vector<std::complex<double>> poles;  // rad/s; empty where the file does not hold them
  std::vector<std::complex<double>> zeros;
  // Of poles, zeros, gain and delay in the coordinates of identify::RootCovariance; empty where the
  // file does not hold it.
  double reference_hz = 0.0;
  std::vector<std::vector<double>> root_covariance{};
  std::optional<StoredChoe> choe{};
  std::vector<std::pair<std::string, std::string>> facts;  // all that is a single value
};

// Fills StoredPoint::more with the numeric columns of `point` that are not named in the reader.
// Columns that hold nothing are left out.
void read_more_columns(Database& database, std::vector<StoredResponse>& responses);

// The table `fit`, empty where the file has none. Each row has `input` and `output`, and either the
// columns num, den (JSON arrays) and delay_s or one column with a JSON object of these keys;
// rows with neither are passed over.
std::vector<StoredFit> read_fits(Database& database);

}  // namespace sinerig::record
