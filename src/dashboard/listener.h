// The listening socket of the live page.
#pragma once

#include <cstdint>

#include "dashboard/address.h"

namespace sinerig::dashboard {

class Listener {
 public:
  // Throws std::runtime_error: the address is in use, not this machine's, or not allowed.
  explicit Listener(const Address& address);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  int socket() const { return socket_; }
  std::uint16_t port() const { return port_; }

  // A new client's socket, non-blocking; -1 when nobody waits.
  int accept();

  // The process has no descriptor left: do not poll() for clients until refresh().
  bool exhausted() const { return exhausted_; }
  void refresh() { exhausted_ = false; }

 private:
  int socket_ = -1;
  std::uint16_t port_ = 0;
  bool exhausted_ = false;
};

}  // namespace sinerig::dashboard
