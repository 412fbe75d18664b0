// Where the live page is served.
#pragma once

#include <cstdint>
#include <string>

namespace sinerig::dashboard {

inline constexpr std::uint16_t default_port = 8077;

struct Address {
  std::string host = "127.0.0.1";  // a numeric address, IPv4 or IPv6
  std::uint16_t port = default_port;

  bool loopback() const;
  bool ipv6() const { return host.find(':') != std::string::npos; }
  std::string text() const;  // "127.0.0.1:8077", "[::1]:8077"
};

// Whether a Host header without its port names the loopback: localhost, [::1], or four numbers that
// begin with 127. "127.evil.example" is somebody's name.
bool is_this_machine(const std::string& host);

// "", "8077", ":8077", "192.168.1.5", "192.168.1.5:8077", "[::1]:8077", "localhost:8077"; what is
// left out is loopback and port 8077, port 0 is any free one. Names other than localhost are not
// looked up. Throws std::invalid_argument.
Address parse_address(const std::string& text);

}  // namespace sinerig::dashboard
