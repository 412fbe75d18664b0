#include "dashboard/server.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <stdexcept>
#include <thread>
#include <unistd.h>
#include <vector>

#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include "dashboard/connection.h"
#include "dashboard/http_request.h"
#include "dashboard/listener.h"
#include "dashboard/live_page.h"

namespace sinerig::dashboard {

namespace {

using std::chrono::steady_clock;

constexpr std::chrono::milliseconds status_interval{100};
constexpr std::chrono::milliseconds idle_interval{1000};
constexpr std::chrono::milliseconds farewell{500};
// A stream that has taken nothing for so long makes room for another.
constexpr std::chrono::seconds stall_patience{2};
// Each client that is let in is read from before it can lose its place to those behind it.
constexpr std::size_t most_accepted_at_once = (Server::most_clients - Server::most_streams) / 2;

// Kernel threads and the loop come first, whatever the clients want.
void step_back() {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
  const sched_param ordinary{};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
  setpriority(PRIO_PROCESS, 0, 10);  // of this thread only, on Linux
  pthread_setname_np(pthread_self(), "sinerig-page");
}

}  // namespace

class Server::Loop {
 public:
  Loop(Settings settings, LiveRun& run)
      : settings_{std::move(settings)},
        run_{run},
        listener_{settings_.address},
        wake_{eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)},
        page_{live_page()} {
    settings_.address.port = listener_.port();
    // Whatever fails here, out of memory say, ends the page and nothing else.
    thread_ = std::thread{[this] {
      try {
        serve();
      } catch (...) {
        clients_.clear();
      }
    }};
  }

  ~Loop() {
    ending_.store(true);
    const std::uint64_t one = 1;
    while (write(wake_, &one, sizeof one) < 0 && errno == EINTR) {
    }
    thread_.join();
    close(wake_);
  }

  const Settings& settings() const { return settings_; }

 private:
  void serve() {
    step_back();
    auto next_status = steady_clock::now();
    auto give_up = steady_clock::time_point::max();
    while (true) {
      wait();
      const auto now = steady_clock::now();
      if (ending_.load() && give_up == steady_clock::time_point::max()) {
        give_up = now + farewell;
        next_status = now;
      }
      if (watched() && now >= next_status) {
        status_ = run_.status();
        ++status_number_;
        next_status = now + status_interval;
      }
      const Text ending = run_.ending();
      for (const auto& client : clients_) {
        client->feed(run_, status_, status_number_, ending);
        client->send(now);
        client->feed(run_, status_, status_number_, ending);
      }
      std::erase_if(clients_, [&](const auto& client) { return client->over(now); });
      if (ending_.load() && (!anyone_waits() || now >= give_up)) return;
    }
  }

  bool watched() const {
    return std::any_of(clients_.begin(), clients_.end(),
                       [](const auto& client) { return client->streaming(); });
  }
  bool anyone_waits() const {
    return std::any_of(clients_.begin(), clients_.end(), [](const auto& client) {
      return client->streaming() && !client->told_all();
    });
  }

  // Until something arrives, can go out, or is due.
  void wait() {
    std::vector<pollfd> sockets;
    const bool room = !listener_.exhausted();
    sockets.push_back({.fd = wake_, .events = POLLIN, .revents = 0});
    sockets.push_back({.fd = room ? listener_.socket() : -1, .events = POLLIN, .revents = 0});
    for (const auto& client : clients_)
      sockets.push_back({.fd = client->socket(), .events = client->interest(), .revents = 0});
    const auto interval = watched() || !room || ending_.load() ? status_interval : idle_interval;
    poll(sockets.data(), sockets.size(), static_cast<int>(interval.count()));
    std::uint64_t count = 0;
    while (read(wake_, &count, sizeof count) > 0) {
    }
    const auto now = steady_clock::now();
    for (std::size_t i = 0; i < clients_.size(); ++i) {
      if ((sockets[i + 2].revents & (POLLIN | POLLHUP | POLLERR)) != 0) receive(*clients_[i], now);
    }
    listener_.refresh();
    if ((sockets[1].revents & POLLIN) != 0) accept_clients(now);
  }

  void accept_clients(steady_clock::time_point now) {
    for (std::size_t i = 0; i < most_accepted_at_once; ++i) {
      const int socket = listener_.accept();
      if (socket < 0) return;
      if (clients_.size() >= most_clients) drop_longest_silent();
      clients_.push_back(std::make_unique<Connection>(socket, now));
    }
  }

  // Of those that do not follow the run: there always are some.
  void drop_longest_silent() {
    const auto before = [](const auto& a, const auto& b) {
      return a->streaming() != b->streaming() ? b->streaming()
                                              : a->last_progress() < b->last_progress();
    };
    clients_.erase(std::min_element(clients_.begin(), clients_.end(), before));
  }

  // One more stream may begin; the one that has stalled for longest makes room where there is none.
  bool room_for_stream(steady_clock::time_point now) {
    std::size_t streams = 0;
    Connection* longest = nullptr;
    for (const auto& client : clients_) {
      if (!client->streaming() || client->over(now)) continue;
      ++streams;
      if (client->stalled() && now - client->last_progress() > stall_patience &&
          (longest == nullptr || client->last_progress() < longest->last_progress()))
        longest = client.get();
    }
    if (streams < most_streams) return true;
    if (longest != nullptr) longest->abandon();
    return longest != nullptr;
  }

  void receive(Connection& client, steady_clock::time_point now) {
    HttpRequest request;
    switch (client.receive(now, request)) {
      case Parsed::incomplete: return;
      case Parsed::complete: return answer(client, request, now);
      case Parsed::malformed: return refuse(client, "400 Bad Request", "This is no request.\n");
      case Parsed::too_long:
        return refuse(client, "431 Request Header Fields Too Large", "Too long.\n");
    }
  }

  void answer(Connection& client, const HttpRequest& request, steady_clock::time_point now) {
    if (!host_is_ours(request.host)) {
      return refuse(client, "403 Forbidden",
                    "Open this page by the address that sinerig printed.\n");
    }
    if (request.method == "POST" && request.path == "/stop") return stop(client, request);
    const bool known =
        request.path == "/" || request.path == "/run.json" || request.path == "/events";
    if (!known) return refuse(client, "404 Not Found", "There is nothing here.\n");
    if (request.method != "GET") return refuse(client, "405 Method Not Allowed", "Only GET.\n");
    if (request.path == "/") return client.answer(head("200 OK", "text/html", page_), page_);
    if (request.path == "/run.json")
      return client.answer(head("200 OK", "application/json", run_.head()), run_.head());
    if (!room_for_stream(now))
      return refuse(client, "503 Service Unavailable", "Too many pages follow this run.\n");
    const std::string_view since = request.last_event_id.empty()
                                       ? query_value(request.query, "since")
                                       : std::string_view{request.last_event_id};
    follow(client, position_in(since));
  }

  // A page that is of another run, of before this one on the same port, must not go on with this.
  void follow(Connection& client, const Position& from) {
    const Text stream = head("200 OK", "text/event-stream", nullptr);
    if (!from.run.empty() && from.run != run_.id()) {
      static const Text reload = std::make_shared<const std::string>("event: reload\ndata: {}\n\n");
      return client.answer(stream, reload);
    }
    client.stream(stream, from.entry);
  }

  // A page of another site that has its name resolve to this machine must not get to read this one.
  bool host_is_ours(const std::string& host) const {
    if (!settings_.address.loopback()) return true;
    return is_this_machine(host);
  }

  void stop(Connection& client, const HttpRequest& request) {
    if (!same_secret(request.token, settings_.token)) {
      return refuse(client, "403 Forbidden",
                    "Stopping needs the token: open the address that sinerig printed.\n");
    }
    settings_.stop();
    // Before anything else is told: no page may say less than what has been asked for.
    status_ = run_.status();
    ++status_number_;
    client.answer(head("204 No Content", "text/plain", std::make_shared<const std::string>()),
                  nullptr);
  }

  static void refuse(Connection& client, const char* status, const char* why) {
    const Text body = std::make_shared<const std::string>(why);
    client.answer(head(status, "text/plain", body), body);
  }

  // Without a body the length is left open: a stream.
  static Text head(const char* status, const char* type, const Text& body) {
    std::string text = std::string{"HTTP/1.1 "} + status + "\r\nContent-Type: " + type +
                       "; charset=utf-8\r\n" +
                       "Cache-Control: no-store\r\nConnection: close\r\n"
                       "X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n"
                       "Cross-Origin-Resource-Policy: same-origin\r\n"
                       "Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; "
                       "style-src 'unsafe-inline'; connect-src 'self'; img-src data:; "
                       "frame-ancestors 'none'; base-uri 'none'; form-action 'none'\r\n";
    if (body) text += "Content-Length: " + std::to_string(body->size()) + "\r\n";
    return std::make_shared<const std::string>(text + "\r\n");
  }

  Settings settings_;
  LiveRun& run_;
  Listener listener_;
  int wake_;
  Text page_;
  Text status_;
  std::uint64_t status_number_ = 0;
  std::vector<std::unique_ptr<Connection>> clients_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

Server::Server(Settings settings, LiveRun& run)
    : loop_{std::make_unique<Loop>(std::move(settings), run)} {}

Server::~Server() = default;

const Address& Server::address() const {
  return loop_->settings().address;
}

std::string Server::url() const {
  Address shown = address();
  if (shown.host == "0.0.0.0" || shown.host == "::") {
    std::array<char, 256> name{};
    gethostname(name.data(), name.size() - 1);
    return "http://" + std::string{name.data()} + ":" + std::to_string(shown.port) +
           "/#token=" + loop_->settings().token;
  }
  return "http://" + shown.text() + "/#token=" + loop_->settings().token;
}

}  // namespace sinerig::dashboard
