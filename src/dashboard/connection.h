// One client of the live page: reads its request, then sends. Never blocks, and holds one message
// at a time: what a slow client has not fetched is asked of the LiveRun again when it is ready for
// it.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "dashboard/http_request.h"
#include "dashboard/live_run.h"

namespace sinerig::dashboard {

// Where in the log of which run a page is: the id of an event, "RUN-17".
struct Position {
  std::string_view run{};  // empty: of whichever run
  std::size_t entry = 0;
};

std::string position_text(const Position& position);
// Begins with the first entry where the text is none.
Position position_in(std::string_view text);

class Connection {
 public:
  using Time = std::chrono::steady_clock::time_point;

  Connection(int socket, Time now);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  int socket() const { return socket_; }
  short interest() const;  // for poll()

  // What has arrived. `complete` once, with the request; `malformed` and `too_long` are for an
  // answer, too.
  Parsed receive(Time now, HttpRequest& request);

  // The whole answer; the connection closes behind it.
  void answer(Text head, Text body);
  // The head of a stream of events; entries of the log from `from` on.
  void stream(Text head, std::size_t from);

  // Puts the next event under way if there is one and the last has gone out. `tick` counts the
  // statuses; false when the stream has told its end.
  void feed(LiveRun& run, const Text& status, std::uint64_t tick, const Text& ending);

  // Sends what the socket takes.
  void send(Time now);

  bool streaming() const { return streaming_; }
  // A stream whose socket takes nothing.
  bool stalled() const { return streaming_ && !idle(); }
  Time last_progress() const { return since_; }
  void abandon() { broken_ = true; }  // over from here on
  bool told_all() const { return ended_ && idle(); }
  // Broken, finished, or without progress for too long.
  bool over(Time now) const;

 private:
  bool idle() const { return !first_ && !second_; }
  void finish_sending(Time now);

  int socket_;
  Time since_;  // of the last progress
  std::string received_;
  Text first_;  // what is being sent …
  Text second_;
  std::size_t sent_ = 0;  // … of first_
  bool answered_ = false;
  bool streaming_ = false;
  bool half_closed_ = false;
  bool broken_ = false;
  bool ended_ = false;
  std::size_t next_entry_ = 0;
  std::uint64_t status_seen_ = 0;
};

}  // namespace sinerig::dashboard
