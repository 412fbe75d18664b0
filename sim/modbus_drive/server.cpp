#include "sim/modbus_drive/server.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "drivers/monotonic_time.h"

namespace sinerig::sim {
namespace {

constexpr std::int64_t ns_per_s = 1'000'000'000;
constexpr std::int64_t never = std::numeric_limits<std::int64_t>::max();

std::int64_t nanoseconds(double seconds) {
  return std::llround(seconds * 1e9);
}

}  // namespace

DriveServer::DriveServer(DriveSettings settings)
    : settings_{std::move(settings)},
      line_{settings_.serial ? make_serial_line(settings_) : make_tcp_line(settings_)},
      start_ns_{monotonic_now_ns()},
      drive_{settings_, start_ns_},
      random_{settings_.faults.seed} {}

std::string DriveServer::account() const {
  static constexpr const char* states[] = {"off", "on", "tripped"};
  std::string text;
  for (const Drive::Change& change : drive_.changes()) {
    char line[96];
    std::snprintf(line, sizeof line, "%s at %.6f s, set-point %g\n", states[change.state],
                  static_cast<double>(change.time_ns - start_ns_) * 1e-9, change.set_point);
    text += line;
  }
  return text;
}

bool DriveServer::chance(double fraction) {
  return fraction > 0.0 && std::uniform_real_distribution<double>{}(random_) < fraction;
}

bool DriveServer::past(double at_s, std::int64_t now_ns) const {
  return at_s > 0.0 && now_ns >= start_ns_ + nanoseconds(at_s);
}

void DriveServer::run(const std::atomic<bool>& stop, double seconds, double patience_s) {
  const std::int64_t end_ns = seconds < 1e8 ? start_ns_ + nanoseconds(seconds) : never;
  while (!stop.load()) {
    // Requests first: what came before now must reach the motor before now is sampled.
    for (const Frame& request : line_->receive()) serve(request, monotonic_now_ns());
    const std::int64_t now_ns = monotonic_now_ns();
    if (now_ns >= end_ns) return;
    cause_faults(now_ns);
    drive_.watch(now_ns);
    send_due(now_ns);
    const std::int64_t due_ns = std::min(next_due_ns(), end_ns);
    const std::int64_t left_ns =
        std::clamp<std::int64_t>(due_ns - monotonic_now_ns(), 0, nanoseconds(patience_s));
    std::vector<pollfd> inputs = line_->inputs();
    const timespec timeout{.tv_sec = left_ns / ns_per_s, .tv_nsec = left_ns % ns_per_s};
    ppoll(inputs.data(), inputs.size(), &timeout, nullptr);
  }
}

void DriveServer::serve(const Frame& request, std::int64_t received_ns) {
  if (booting_ || request.unit != settings_.unit) return;
  const DriveFaults& faults = settings_.faults;
  const std::int64_t complete_ns = received_ns + line_->wire_ns(request);
  Frame reply = request;
  if (chance(faults.exception_fraction) || past(faults.exception_at_s, received_ns))
    reply.pdu = {static_cast<std::uint8_t>(request.pdu[0] + 128), 4};
  else
    reply.pdu = drive_.answer(request.pdu, complete_ns);

  if (past(faults.silent_at_s, received_ns) || chance(faults.lost_fraction)) return;
  std::int64_t due_ns = complete_ns + settings_.turn_around_ns + line_->wire_ns(reply);
  if (faults.late_max_s > 0.0)
    due_ns += nanoseconds(faults.late_max_s * std::uniform_real_distribution<double>{}(random_));
  if (chance(faults.late_fraction)) due_ns += nanoseconds(faults.late_s);
  replies_.push_back(
      {.due_ns = due_ns, .frame = reply, .spoiled = chance(faults.spoiled_fraction)});
}

void DriveServer::send_due(std::int64_t now_ns) {
  std::ranges::stable_sort(replies_, {}, &Reply::due_ns);
  std::size_t sent = 0;
  for (; sent < replies_.size() && replies_[sent].due_ns <= now_ns; ++sent)
    line_->send(replies_[sent].frame, replies_[sent].spoiled);
  replies_.erase(replies_.begin(), replies_.begin() + static_cast<std::ptrdiff_t>(sent));
}

void DriveServer::cause_faults(std::int64_t now_ns) {
  const DriveFaults& faults = settings_.faults;
  if (!tripped_ && past(faults.error_at_s, now_ns)) {
    tripped_ = true;
    drive_.trip(now_ns);
  }
  if (!dropped_ && past(faults.drop_at_s, now_ns)) {
    dropped_ = true;
    line_->drop();
    replies_.clear();
  }
  if (!cycled_ && past(faults.power_cycle_at_s, now_ns)) {
    cycled_ = true;
    booting_ = true;
    booted_ns_ = now_ns + boot_ns;
    drive_.lose_power(now_ns);
    line_->set_open(false);
    line_->drop();
    replies_.clear();
  }
  if (booting_ && now_ns >= booted_ns_) {
    booting_ = false;
    line_->set_open(true);
  }
}

std::int64_t DriveServer::next_due_ns() const {
  std::int64_t due_ns = never;
  for (const Reply& reply : replies_) due_ns = std::min(due_ns, reply.due_ns);
  const auto later = [&](double at_s, bool done) {
    if (at_s > 0.0 && !done) due_ns = std::min(due_ns, start_ns_ + nanoseconds(at_s));
  };
  later(settings_.faults.error_at_s, tripped_);
  later(settings_.faults.drop_at_s, dropped_);
  later(settings_.faults.power_cycle_at_s, cycled_);
  if (booting_) due_ns = std::min(due_ns, booted_ns_);
  return due_ns;
}

}  // namespace sinerig::sim
