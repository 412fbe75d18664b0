#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "record/mat_file.h"
#include "record/mat_value.h"
#include "record/point_columns.h"

namespace sinerig::record {

namespace {

// Every variable of the file; the fields of structs beside them, where their names are free.
class Variables {
 public:
  explicit Variables(const std::string& path) : path_{path} {
    const MatFile file{Mat_Open(path.c_str(), MAT_ACC_RDONLY)};
    if (file == nullptr) throw SweepFileError(path + ": is not a MATLAB file");
    while (MatValue value{Mat_VarReadNext(file.get())}) owned_.push_back(std::move(value));
    for (const MatValue& value : owned_) {
      if (value->name != nullptr) named_.emplace(value->name, value.get());
    }
    for (const MatValue& value : owned_) {
      if (value->class_type != MAT_C_STRUCT) continue;
      char* const* names = Mat_VarGetStructFieldnames(value.get());
      for (unsigned i = 0; i < Mat_VarGetNumberOfFields(value.get()); ++i)
        named_.emplace(names[i], Mat_VarGetStructFieldByIndex(value.get(), i, 0));
    }
  }

  const matvar_t* find(const std::string& name) const {
    const auto found = named_.find(name);
    return found == named_.end() ? nullptr : found->second;
  }

  [[noreturn]] void refuse(const std::string& what) const {
    throw SweepFileError(path_ + ": " + what);
  }

 private:
  std::string path_;
  std::vector<MatValue> owned_;
  std::map<std::string, const matvar_t*> named_;
};

double hz_per_unit(const Variables& variables) {
  const std::string unit = text_value(variables.find("FrequencyUnit"));
  if (unit == "Hz") return 1.0;
  if (unit == "kHz") return 1e3;
  if (unit == "rpm") return 1.0 / 60.0;
  if (unit.empty() || unit == "rad/s" || unit == "rad/TimeUnit") return 0.5 / std::numbers::pi;
  variables.refuse("FrequencyUnit = \"" + unit + "\"; it has to be Hz, kHz, rad/s or rpm");
}

// The shape of ResponseData, from a plain vector on up.
struct Shape {
  std::size_t outputs = 1;
  std::size_t inputs = 1;
  std::size_t length = 0;

  std::size_t at(std::size_t output, std::size_t input, std::size_t k) const {
    return (k * inputs + input) * outputs + output;
  }
  std::size_t size() const { return outputs * inputs * length; }
};

Shape shape_of(const Variables& variables, const matvar_t* response, std::size_t length) {
  Shape shape{.outputs = 1, .inputs = 1, .length = length};
  if (response->rank == 3) {
    shape.outputs = response->dims[0];
    shape.inputs = response->dims[1];
  }
  std::size_t size = 1;
  for (int i = 0; i < response->rank; ++i) size *= response->dims[i];
  if (size != shape.size()) {
    variables.refuse("ResponseData has " + std::to_string(size) + " values, Frequency " +
                     std::to_string(length) + ": it has to be outputs × inputs × frequencies");
  }
  return shape;
}

// Figures of every point, where their size is that of the response.
struct Figures {
  std::vector<std::complex<double>> response;
  std::vector<double> covariance;  // four times the size, or nothing
  std::map<const char*, std::vector<double>> columns;
  std::vector<std::string> status;
  std::vector<std::string> reason;
  std::vector<std::string> settled_by;
};

Figures figures_of(const Variables& variables, const matvar_t* response, const Shape& shape) {
  Figures figures{.response = complex_values(response),
                  .covariance = real_values(variables.find("CovarianceData")),
                  .columns = {},
                  .status = text_values(variables.find("status")),
                  .reason = text_values(variables.find("reason")),
                  .settled_by = text_values(variables.find("settled_by"))};
  if (figures.covariance.size() != 4 * shape.size()) figures.covariance.clear();
  if (figures.status.size() != shape.size()) figures.status.clear();
  if (figures.reason.size() != shape.size()) figures.reason.clear();
  if (figures.settled_by.size() != shape.size()) figures.settled_by.clear();
  for (const PointColumn& column : point_columns) {
    std::vector<double> values = real_values(variables.find(column.name));
    if (values.size() == shape.size()) figures.columns.emplace(column.name, std::move(values));
  }
  return figures;
}

StoredPoint point_of(const Figures& figures, std::size_t at, std::size_t size) {
  StoredPoint point = imported_point();
  point.response = figures.response[at];
  const std::vector<double>& c = figures.covariance;
  if (!c.empty()) point.covariance = {c[at], c[at + size], c[at + 3 * size]};
  const bool scatter = std::isfinite(point.covariance.re_re + point.covariance.im_im);
  point.dof = scatter ? std::numeric_limits<double>::infinity() : 0.0;
  for (const PointColumn& column : point_columns) {
    const auto found = figures.columns.find(column.name);
    if (found != figures.columns.end()) point.*column.value = found->second[at];
  }
  if (!figures.status.empty()) point.status = figures.status[at];
  if (!figures.reason.empty()) point.reason = figures.reason[at];
  if (!figures.settled_by.empty()) point.settled_by = figures.settled_by[at];
  return point;
}

ChannelInfo channel_of(const Variables& variables, const std::string& side, std::size_t index,
                       const std::string& otherwise) {
  const std::vector<std::string> names = text_values(variables.find(side + "Name"));
  const std::vector<std::string> units = text_values(variables.find(side + "Unit"));
  const std::string name = index < names.size() ? names[index] : std::string{};
  return {name.empty() ? otherwise : name, index < units.size() ? units[index] : ""};
}

// An array of pairs has a place for those that were not measured, too: NaN, and no status.
bool measured(const std::vector<StoredPoint>& points) {
  return std::any_of(points.begin(), points.end(), [](const StoredPoint& point) {
    const bool stated = !point.status.empty() && point.status != "imported";
    return stated || !std::isnan(point.response.real()) || !std::isnan(point.response.imag());
  });
}

}  // namespace

std::vector<ImportedResponse> read_mat(const std::string& path) {
  const Variables variables{path};
  const matvar_t* response = variables.find("ResponseData");
  const std::vector<double> frequency = real_values(variables.find("Frequency"));
  if (response == nullptr || frequency.empty()) {
    variables.refuse(
        "no variables ResponseData and Frequency; in MATLAB: s = struct('ResponseData', "
        "sys.ResponseData, 'Frequency', sys.Frequency, 'FrequencyUnit', sys.FrequencyUnit); "
        "save('file.mat', '-struct', 's', '-v6')");
  }
  const double hz = hz_per_unit(variables);
  const Shape shape = shape_of(variables, response, frequency.size());
  const Figures figures = figures_of(variables, response, shape);
  if (figures.response.size() != shape.size()) variables.refuse("ResponseData is not numeric");
  const std::vector<double> hold_rates = real_values(variables.find("HoldRate"));
  std::vector<ImportedResponse> responses;
  for (std::size_t input = 0; input < shape.inputs; ++input) {
    for (std::size_t output = 0; output < shape.outputs; ++output) {
      const std::string otherwise =
          shape.outputs > 1 ? "output" + std::to_string(output + 1) : "output";
      ImportedResponse each{
          .input = channel_of(variables, "Input", input,
                              shape.inputs > 1 ? "input" + std::to_string(input + 1) : "applied"),
          .output = channel_of(variables, "Output", output, otherwise),
          .points = {},
          .hold_rate_hz = 0.0,
          .left_out = 0};
      if (hold_rates.size() == shape.outputs * shape.inputs)
        each.hold_rate_hz = std::max(hold_rates[input * shape.outputs + output], 0.0);
      for (std::size_t k = 0; k < shape.length; ++k) {
        each.points.push_back(point_of(figures, shape.at(output, input, k), shape.size()));
        each.points.back().frequency_hz = frequency[k] * hz;
      }
      if (measured(each.points)) responses.push_back(std::move(each));
    }
  }
  if (responses.empty()) variables.refuse("ResponseData has no value that is a number");
  return responses;
}

}  // namespace sinerig::record
