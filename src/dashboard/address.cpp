#include "dashboard/address.h"

#include <arpa/inet.h>
#include <charconv>
#include <stdexcept>

namespace sinerig::dashboard {

namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw std::invalid_argument{"--serve " + text + ": " + why +
                              "; give ADDR:PORT, such as 127.0.0.1:8077 (only this machine) or "
                              "0.0.0.0:8077 (every network it is in)"};
}

bool digits_only(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
}

std::uint16_t port_of(const std::string& text, const std::string& whole) {
  unsigned value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != end || value > 65535U)
    refuse(whole, "\"" + text + "\" is no port, 0 to 65535");
  return static_cast<std::uint16_t>(value);
}

}  // namespace

bool Address::loopback() const {
  return host == "::1" || host.rfind("127.", 0) == 0;
}

std::string Address::text() const {
  return (ipv6() ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

Address parse_address(const std::string& text) {
  Address address;
  if (text.empty()) return address;
  if (digits_only(text)) {
    address.port = port_of(text, text);
    return address;
  }
  std::string host = text;
  const std::size_t colon = text.rfind(':');
  if (text.front() == '[') {
    const std::size_t bracket = text.find(']');
    if (bracket == std::string::npos) refuse(text, "the ] is missing");
    host = text.substr(1, bracket - 1);
    if (bracket + 1 < text.size()) {
      if (text[bracket + 1] != ':') refuse(text, "a : belongs behind the ]");
      address.port = port_of(text.substr(bracket + 2), text);
    }
  } else if (colon != std::string::npos && text.find(':') == colon) {
    host = text.substr(0, colon);
    address.port = port_of(text.substr(colon + 1), text);
  }
  if (host == "localhost") host = "127.0.0.1";
  if (!host.empty()) address.host = host;
  unsigned char bytes[sizeof(in6_addr)];
  if (inet_pton(address.ipv6() ? AF_INET6 : AF_INET, address.host.c_str(), bytes) != 1)
    refuse(text, "\"" + host + "\" is no numeric address");
  return address;
}

bool is_this_machine(const std::string& host) {
  if (host == "localhost" || host == "[::1]") return true;
  in_addr address{};
  return inet_pton(AF_INET, host.c_str(), &address) == 1 &&
         (ntohl(address.s_addr) >> 24U) == IN_LOOPBACKNET;
}

}  // namespace sinerig::dashboard
