#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>

#include "record/mat_file.h"
#include "record/mat_value.h"
#include "record/part_file.h"
#include "record/point_columns.h"
#include "version.h"

namespace sinerig::record {

namespace {

// The channels on one side of the responses, each once, in the order of their first appearance.
std::vector<std::uint32_t> distinct(const std::vector<const StoredResponse*>& responses,
                                    std::uint32_t StoredResponse::*side) {
  std::vector<std::uint32_t> channels;
  for (const StoredResponse* each : responses) {
    if (std::find(channels.begin(), channels.end(), each->*side) == channels.end())
      channels.push_back(each->*side);
  }
  return channels;
}

// Responses as the ny×nu×nf arrays of MATLAB, the first index running fastest.
class Grid {
 public:
  explicit Grid(const std::vector<const StoredResponse*>& responses)
      : outputs_{distinct(responses, &StoredResponse::output)},
        inputs_{distinct(responses, &StoredResponse::input)},
        length_{responses.front()->points.size()},
        points_(outputs_.size() * inputs_.size() * length_, nullptr),
        hold_rates_(outputs_.size() * inputs_.size(), 0.0) {
    for (const StoredResponse* response : responses) {
      const std::size_t row = place(outputs_, response->output);
      const std::size_t column = place(inputs_, response->input);
      hold_rates_[column * outputs_.size() + row] = response->hold_rate_hz;
      for (std::size_t k = 0; k < length_; ++k)
        points_[(k * inputs_.size() + column) * outputs_.size() + row] = &response->points[k];
    }
  }

  const std::vector<std::uint32_t>& outputs() const { return outputs_; }
  const std::vector<std::uint32_t>& inputs() const { return inputs_; }
  Dimensions dimensions() const { return {outputs_.size(), inputs_.size(), length_}; }
  const std::vector<const StoredPoint*>& points() const { return points_; }

  // Hz, of the zero-order hold of each pair, 0 where there is none.
  const std::vector<double>& hold_rates() const { return hold_rates_; }

  template <typename Value>
  std::vector<double> numbers(Value value) const {
    std::vector<double> all;
    for (const StoredPoint* point : points_)
      all.push_back(point == nullptr ? nan_value : value(*point));
    return all;
  }

  std::vector<std::string> texts(std::string StoredPoint::*text) const {
    std::vector<std::string> all;
    for (const StoredPoint* point : points_)
      all.push_back(point == nullptr ? std::string{} : point->*text);
    return all;
  }

 private:
  static std::size_t place(const std::vector<std::uint32_t>& channels, std::uint32_t channel) {
    return static_cast<std::size_t>(std::find(channels.begin(), channels.end(), channel) -
                                    channels.begin());
  }

  std::vector<std::uint32_t> outputs_;
  std::vector<std::uint32_t> inputs_;
  std::size_t length_;
  std::vector<const StoredPoint*> points_;
  std::vector<double> hold_rates_;
};

void refuse_different_grids(const std::string& path,
                            const std::vector<const StoredResponse*>& responses) {
  const auto same = [&](const StoredResponse* each) {
    return std::equal(each->points.begin(), each->points.end(), responses.front()->points.begin(),
                      responses.front()->points.end(), [](const auto& a, const auto& b) {
                        return a.frequency_hz == b.frequency_hz;
                      });
  };
  if (std::all_of(responses.begin(), responses.end(), same)) return;
  throw SweepFileError(path +
                       ": the responses do not share their frequencies, one MATLAB array cannot "
                       "hold them; export them one by one with --channel");
}

using Variables = std::vector<MatValue>;

void add_channels(Variables& variables, const StoredRun& run, const Grid& grid) {
  const auto add = [&](const char* name, const std::vector<std::uint32_t>& channels,
                       std::string ChannelInfo::*part) {
    std::vector<std::string> texts;
    texts.reserve(channels.size());
    for (const std::uint32_t channel : channels) texts.push_back(run.channels.at(channel).*part);
    variables.push_back(mat_texts(name, {channels.size(), 1}, texts));
  };
  add("OutputName", grid.outputs(), &ChannelInfo::name);
  add("OutputUnit", grid.outputs(), &ChannelInfo::unit);
  add("InputName", grid.inputs(), &ChannelInfo::name);
  add("InputUnit", grid.inputs(), &ChannelInfo::unit);
}

std::vector<double> covariance_data(const Grid& grid) {
  std::vector<double> all;
  for (const double Covariance2::*part :
       {&Covariance2::re_re, &Covariance2::re_im, &Covariance2::re_im, &Covariance2::im_im}) {
    const std::vector<double> values =
        grid.numbers([&](const StoredPoint& point) { return point.covariance.*part; });
    all.insert(all.end(), values.begin(), values.end());
  }
  return all;
}

Variables variables_of(const StoredRun& run, const std::vector<const StoredResponse*>& responses) {
  const Grid grid{responses};
  std::vector<std::complex<double>> response;
  for (const StoredPoint* point : grid.points())
    response.push_back(point == nullptr ? std::complex<double>{nan_value, nan_value}
                                        : point->response);
  std::vector<double> frequency;
  for (const StoredPoint& point : responses.front()->points)
    frequency.push_back(point.frequency_hz);
  Dimensions with_covariance = grid.dimensions();
  with_covariance.insert(with_covariance.end(), {2, 2});

  Variables all;
  all.push_back(mat_array("ResponseData", grid.dimensions(), response));
  all.push_back(mat_array("Frequency", {frequency.size(), 1}, frequency));
  all.push_back(mat_text("FrequencyUnit", "Hz"));
  all.push_back(mat_array("CovarianceData", with_covariance, covariance_data(grid)));
  all.push_back(
      mat_array("HoldRate", {grid.outputs().size(), grid.inputs().size()}, grid.hold_rates()));
  all.push_back(mat_array("Ts", {1, 1}, std::vector<double>{0.0}));
  add_channels(all, run, grid);
  for (const PointColumn& column : point_columns) {
    all.push_back(
        mat_array(column.name, grid.dimensions(),
                  grid.numbers([&](const StoredPoint& point) { return point.*column.value; })));
  }
  all.push_back(mat_texts("status", grid.dimensions(), grid.texts(&StoredPoint::status)));
  all.push_back(mat_texts("reason", grid.dimensions(), grid.texts(&StoredPoint::reason)));
  all.push_back(mat_texts("settled_by", grid.dimensions(), grid.texts(&StoredPoint::settled_by)));
  all.push_back(mat_text("Notes", response_convention));
  return all;
}

bool write_all(const std::string& path, const Variables& variables) {
  const std::string remark = std::string{"MATLAB 5.0 MAT-file, sinerig "} + version;
  MatFile file{Mat_CreateVer(path.c_str(), remark.c_str(), MAT_FT_MAT5)};
  if (file == nullptr) return false;
  const bool written = std::all_of(variables.begin(), variables.end(), [&](const MatValue& each) {
    return each != nullptr && Mat_VarWrite(file.get(), each.get(), MAT_COMPRESSION_NONE) == 0;
  });
  return Mat_Close(file.release()) == 0 && written;
}

// Its elements, of which each says at its head how long it is, fill the file to its end.
bool is_complete(const std::string& path) {
  constexpr std::uintmax_t header = 128;
  struct Tag {
    std::uint32_t type;
    std::uint32_t bytes;
  };
  std::ifstream stream{path, std::ios::binary | std::ios::ate};
  const auto size = static_cast<std::uintmax_t>(stream.tellg());
  std::uintmax_t at = header;
  while (stream && at < size) {
    Tag tag{};
    stream.seekg(static_cast<std::streamoff>(at));
    stream.read(reinterpret_cast<char*>(&tag), sizeof tag);
    at += sizeof tag + tag.bytes;
  }
  return stream && at == size;
}

// matio says nothing of what a full disk did not take: whole is what can be read again.
bool holds_all(const std::string& path, const Variables& variables) {
  const MatFile file{Mat_Open(path.c_str(), MAT_ACC_RDONLY)};
  return file != nullptr && is_complete(path) &&
         std::all_of(variables.begin(), variables.end(), [&](const MatValue& each) {
           const MatValue back{Mat_VarReadNext(file.get())};
           return back != nullptr && same_value(*back, *each);
         });
}

}  // namespace

void write_mat(const std::string& path, const StoredRun& run,
               const std::vector<const StoredResponse*>& responses) {
  refuse_different_grids(path, responses);
  const Variables variables = variables_of(run, responses);
  PartFile part{path};
  if (!write_all(part.path(), variables) || !holds_all(part.path(), variables)) {
    throw SweepFileError(path +
                         ": cannot be written, or not in full: is there room on the disk, and may "
                         "the folder be written to?");
  }
  part.take_its_place();
}

}  // namespace sinerig::record
