// Clients of a live page in a process of their own: ones that read, stall or misbehave.
#pragma once

#include <cstdint>
#include <optional>

#include <sys/types.h>

namespace sinerig::bench {

enum class ClientKind : int {
  none,
  watch,      // read whatever comes, as browsers do
  stall,      // ask for the stream and never read; small windows, so that the server feels it
  misbehave,  // connect, send nonsense, half a request or a Stop without the token, go, begin again
};

class PageClients {
 public:
  // Starts this program once more as `count` clients of the port on the loopback; returns once all
  // are connected. Throws std::runtime_error when that fails.
  PageClients(ClientKind kind, int count, std::uint16_t port);
  ~PageClients();
  PageClients(const PageClients&) = delete;
  PageClients& operator=(const PageClients&) = delete;

  // Throws where they have ended by themselves.
  void require() const;

 private:
  pid_t child_ = -1;
};

// In the process that PageClients starts: the clients, until they are ended; then the exit code.
// Nothing in any other process.
std::optional<int> act_as_clients(int count, char** arguments);

}  // namespace sinerig::bench
