#include "dashboard/connection.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <poll.h>
#include <unistd.h>

#include <sys/socket.h>

namespace sinerig::dashboard {

namespace {

constexpr std::chrono::seconds request_timeout{5};
constexpr std::chrono::seconds send_timeout{20};
// For the other side to read what was sent before the socket goes: a close with unread bytes in it
// resets the connection.
constexpr std::chrono::seconds linger_timeout{1};

Text event(const char* name, const std::string& id, const std::string& data) {
  return std::make_shared<const std::string>((id.empty() ? "" : "id: " + id + "\n") +
                                             "event: " + name + "\ndata: " + data + "\n\n");
}

}  // namespace

std::string position_text(const Position& position) {
  return std::string{position.run} + "-" + std::to_string(position.entry);
}

Position position_in(std::string_view text) {
  Position position;
  if (const std::size_t dash = text.find('-'); dash != std::string_view::npos) {
    position.run = text.substr(0, dash);
    text.remove_prefix(dash + 1);
  }
  std::from_chars(text.data(), text.data() + text.size(), position.entry);
  return position;
}

Connection::Connection(int socket, Time now) : socket_{socket}, since_{now} {}

Connection::~Connection() {
  close(socket_);
}

short Connection::interest() const {
  return static_cast<short>(POLLIN | (idle() ? 0 : POLLOUT));
}

Parsed Connection::receive(Time now, HttpRequest& request) {
  std::array<char, 4096> bytes{};
  const ssize_t count = recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR)) broken_ = true;
  // Whatever follows a request is of no interest.
  if (count <= 0 || answered_) return Parsed::incomplete;
  received_.append(bytes.data(), static_cast<std::size_t>(count));
  const Parsed parsed = parse_request(received_, request);
  if (parsed == Parsed::incomplete) return parsed;
  answered_ = true;
  received_ = {};
  since_ = now;
  return parsed;
}

void Connection::answer(Text head, Text body) {
  first_ = std::move(head);
  second_ = std::move(body);
}

void Connection::stream(Text head, std::size_t from) {
  first_ = std::move(head);
  streaming_ = true;
  next_entry_ = from;
}

void Connection::feed(LiveRun& run, const Text& status, std::uint64_t tick, const Text& ending) {
  if (!streaming_ || !idle() || ended_) return;
  std::size_t next = next_entry_;
  if (const Text entries = run.log(next_entry_, next)) {
    first_ = event("log", position_text({.run = run.id(), .entry = next}), *entries);
    next_entry_ = next;
  } else if (tick != status_seen_ && status) {
    first_ = event("status", "", *status);
    status_seen_ = tick;
  } else if (ending) {
    first_ = event("end", "", *ending);
    ended_ = true;
  }
}

void Connection::send(Time now) {
  while (!idle() && !broken_) {
    if (!first_) first_ = std::move(second_);
    const std::size_t left = first_->size() - sent_;
    const ssize_t count =
        ::send(socket_, first_->data() + sent_, left, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (count < 0) {
      broken_ = errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR;
      return;
    }
    since_ = now;
    sent_ += static_cast<std::size_t>(count);
    if (sent_ < first_->size()) return;
    first_ = nullptr;
    second_.swap(first_);
    sent_ = 0;
  }
  if (answered_ && (!streaming_ || ended_)) finish_sending(now);
}

void Connection::finish_sending(Time now) {
  if (half_closed_ || !idle()) return;
  shutdown(socket_, SHUT_WR);
  half_closed_ = true;
  since_ = now;
}

bool Connection::over(Time now) const {
  if (broken_) return true;
  if (half_closed_) return now - since_ > linger_timeout;
  if (!answered_) return now - since_ > request_timeout;
  return !idle() && now - since_ > send_timeout;
}

}  // namespace sinerig::dashboard
