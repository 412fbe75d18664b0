#include "cli/service_notifier.h"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <unistd.h>
#include <utility>

#include <sys/socket.h>
#include <sys/un.h>

#include "report/terminal.h"

namespace sinerig::cli {

namespace {

// Asked for again long before it is over.
constexpr std::chrono::microseconds more_time = std::chrono::seconds{60};

constexpr std::chrono::milliseconds turn_of_attendant{50};

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

// The watchdog is another process's where $WATCHDOG_PID says so.
std::chrono::microseconds watchdog_period() {
  const std::string pid = variable("WATCHDOG_PID");
  if (!pid.empty() && pid != std::to_string(getpid())) return {};
  return std::chrono::microseconds{std::strtoll(variable("WATCHDOG_USEC").c_str(), nullptr, 10)};
}

}  // namespace

ServiceNotifier::ServiceNotifier()
    : ServiceNotifier{variable("NOTIFY_SOCKET"), watchdog_period()} {}

ServiceNotifier::ServiceNotifier(std::string socket, std::chrono::microseconds watchdog)
    : socket_{std::move(socket)}, watchdog_{watchdog} {
  const bool usable = socket_.size() > 1 && socket_.size() < sizeof(sockaddr_un::sun_path) &&
                      (socket_[0] == '/' || socket_[0] == '@');
  if (usable) descriptor_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
}

ServiceNotifier::~ServiceNotifier() {
  if (descriptor_ >= 0) close(descriptor_);
}

// A manager that does not listen is no reason to stop a sweep, nor to wait for it.
void ServiceNotifier::send(const std::string& message) {
  if (descriptor_ < 0) return;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, socket_.data(), socket_.size());
  if (address.sun_path[0] == '@') address.sun_path[0] = '\0';  // an abstract name
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + socket_.size());
  sendto(descriptor_, message.data(), message.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
         reinterpret_cast<const sockaddr*>(&address), length);
}

void ServiceNotifier::ready() {
  if (!std::exchange(ready_, true)) send("READY=1");
}

void ServiceNotifier::status(const std::string& text) {
  if (text == status_) return;
  status_ = text;
  send("STATUS=" + text);
}

void ServiceNotifier::progress(std::uint64_t progress, Time now) {
  if (progress == fed_at_ || now < next_) return;
  fed_at_ = progress;
  feed(now);
}

void ServiceNotifier::idle(Time now) {
  fed_at_ = UINT64_MAX;  // the ticks of the next loop begin anew
  if (now >= next_) feed(now);
}

void ServiceNotifier::feed(Time now) {
  const bool watched = watchdog_.count() > 0;
  const bool counted = !ready_ || stopping_;
  std::string meal;
  if (watched) meal.append("WATCHDOG=1");
  if (watched && counted) meal.append("\n");
  if (counted) meal.append("EXTEND_TIMEOUT_USEC=").append(std::to_string(more_time.count()));
  next_ = now + (watched ? std::min(watchdog_, more_time) : more_time) / 4;
  if (!meal.empty()) send(meal);
}

void ServiceNotifier::stopping() {
  stopping_ = true;
  send(watchdog_.count() > 0 ? "STOPPING=1\nWATCHDOG=1" : "STOPPING=1");
}

SignOfLife for_at_most(std::chrono::nanoseconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  return [end, turns = std::uint64_t{0}]() mutable {
    if (std::chrono::steady_clock::now() < end) ++turns;
    return turns;
  };
}

Attendant::Attendant(ServiceNotifier& service, SignOfLife life) {
  if (!service.heard()) return;
  thread_ = std::thread{[this, &service, life = std::move(life)] {
    std::unique_lock lock{mutex_};
    while (!changed_.wait_for(lock, turn_of_attendant, [this] { return done_; }))
      service.progress(life(), std::chrono::steady_clock::now());
  }};
}

Attendant::~Attendant() {
  if (!thread_.joinable()) return;
  {
    const std::scoped_lock lock{mutex_};
    done_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::string status_text(const SweepPlan& plan, std::uint32_t dwell,
                        const report::RemainingTime& time) {
  if (dwell >= plan.dwells.size()) return "all planned points are done";
  char text[64];
  std::snprintf(text, sizeof text, "point %u of %zu, %.4g Hz, ", dwell + 1U, plan.dwells.size(),
                plan.dwells[dwell].frequency_hz(plan.rate_hz));
  return text + report::duration_text(time.remaining_s()) + " left";
}

}  // namespace sinerig::cli
