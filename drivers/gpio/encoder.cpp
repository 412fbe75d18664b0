#include "drivers/gpio/encoder.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

namespace sinerig::gpio {
namespace {

// Sequence numbers begin again after 2^32.
std::int32_t ahead(std::uint32_t sequence, std::uint32_t of) noexcept {
  return static_cast<std::int32_t>(sequence - of);
}

}  // namespace

Encoder::Encoder(std::unique_ptr<EdgeLines> lines, const EncoderSettings& settings,
                 const Clock& clock)
    : lines_{std::move(lines)}, settings_{settings}, clock_{clock} {
  last_.value = settings_.offset;
  // An edge between the reading of the levels and the first read() must not count twice.
  while (true) {
    const auto levels = lines_->get();
    const auto taken = lines_->take(waiting_);
    if (!levels || !taken)
      throw std::runtime_error("the lines of the encoder can be requested but not read");
    if (*taken == 0) {
      decoder_.start(*levels);
      return;
    }
    next_sequence_ = waiting_[*taken - 1].sequence + 1;
  }
}

Sample Encoder::read() noexcept {
  const std::int64_t now_ns = clock_.time_ns(clock_.now());
  const std::uint64_t errors_before = errors();
  gone_ = !gather();
  count_until(now_ns - settings_.lag_ns);
  last_.fault = Fault::none;
  if (settings_.samples == EncoderSettings::Samples::count) {
    last_.value = settings_.offset + settings_.scale * static_cast<double>(decoder_.count());
    last_.time_ns = now_ns - settings_.lag_ns;
  } else if (!crossed_) {
    last_.fault = Fault::stale;
  }
  if (gone_ || errors() != errors_before || errors() > settings_.max_errors)
    last_.fault = Fault::bus;
  last_time_ns_ = now_ns - settings_.lag_ns;
  return last_;
}

// The kernel's queue is shorter than `capacity`: one read empties it. An edge younger than the lag
// waits for the loop.
void Encoder::catch_up() {
  read();
  if (gone_) throw std::runtime_error("the lines of the encoder can no longer be read");
  forgiven_ = all_errors();
}

// The kernel queues each line's edges from a thread of its own: neighbours may have changed places.
bool Encoder::gather() noexcept {
  const auto taken = lines_->take(std::span{waiting_}.subspan(waiting_count_));
  if (!taken) return false;
  const std::size_t end = waiting_count_ + *taken;
  for (std::size_t n = waiting_count_; n < end; ++n) {
    if (waiting_[n].time_ns <= last_time_ns_) {
      ++late_;
      latest_ns_ = std::max(latest_ns_, last_time_ns_ - waiting_[n].time_ns);
    }
    for (std::size_t m = n; m > 0 && ahead(waiting_[m].sequence, waiting_[m - 1].sequence) < 0; --m)
      std::swap(waiting_[m], waiting_[m - 1]);
  }
  waiting_count_ = end;
  return true;
}

void Encoder::count_until(std::int64_t time_ns) noexcept {
  crossed_ = false;
  std::size_t done = 0;
  for (; done < waiting_count_ && waiting_[done].time_ns <= time_ns; ++done) {
    const Edge& edge = waiting_[done];
    const std::int32_t missing = ahead(edge.sequence, next_sequence_);
    if (missing > 0) lost_ += static_cast<std::uint64_t>(missing);
    if (missing >= 0) next_sequence_ = edge.sequence + 1;
    const int step = missing > 0 ? decoder_.resume(edge) : decoder_.apply(edge);
    if (step == 0 || settings_.samples != EncoderSettings::Samples::edge) continue;
    const double border = static_cast<double>(decoder_.count()) - 0.5 * step;
    last_.value = settings_.offset + settings_.scale * border;
    last_.time_ns = edge.time_ns;
    crossed_ = true;
  }
  std::copy(waiting_.begin() + static_cast<std::ptrdiff_t>(done),
            waiting_.begin() + static_cast<std::ptrdiff_t>(waiting_count_), waiting_.begin());
  waiting_count_ -= done;
}

std::string Encoder::reason() const {
  if (gone_) return "the lines can no longer be read";
  if (errors() <= settings_.max_errors) return "";
  return std::to_string(decoder_.illegal()) + " illegal transitions and " + std::to_string(lost_) +
         " lost edges (errors_max = " + std::to_string(settings_.max_errors) + ")";
}

std::string Encoder::seen() const {
  std::string text = std::to_string(decoder_.illegal()) + " illegal transitions, " +
                     std::to_string(lost_) + " lost edges";
  if (!doubtful()) return text;
  const double lag_s = static_cast<double>(settings_.lag_ns) * 1e-9;
  const double latest_s = static_cast<double>(latest_ns_) * 1e-9;
  char late[160];
  std::snprintf(late, sizeof late,
                ", %llu edges later than lag_s = %g by up to %.2g s: samples before them miss "
                "counts; lag_s = %.2g has room for them",
                static_cast<unsigned long long>(late_), lag_s, latest_s, 1.5 * (lag_s + latest_s));
  return text + late;
}

}  // namespace sinerig::gpio
