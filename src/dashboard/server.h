// Serves the live page: one thread, one poll(), a bounded amount of memory per client whatever the
// client does. Not a general web server, and why there is none here: a thread per watcher, each
// with a stack that mlockall() keeps in memory, is what a real-time process must not have.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "dashboard/address.h"
#include "dashboard/live_run.h"
#include "dashboard/token.h"

namespace sinerig::dashboard {

class Server {
 public:
  static constexpr std::size_t most_clients = 256;
  // Of them, those that follow the run. The other places are for requests, above all for the one to
  // stop; whoever connects gets one, and the client that has been silent there for longest loses
  // it.
  static constexpr std::size_t most_streams = 64;

  struct Settings {
    Address address;
    std::string token;           // what POST /stop has to bring
    std::function<void()> stop;  // called on the server's thread
  };

  // Listens from here on. Throws std::runtime_error when the address can't be had. `run` must
  // outlive the server.
  Server(Settings settings, LiveRun& run);

  // Gives every watcher what is still to be told, for half a second at most, and ends.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  const Address& address() const;  // with the port that was given
  std::string url() const;         // for the browser, the token in its fragment

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace sinerig::dashboard
