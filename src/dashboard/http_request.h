// The head of an HTTP request, as far as the live page needs it. Whatever it does not need is an
// error: the bytes come from anybody who can reach the port.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace sinerig::dashboard {

inline constexpr std::size_t longest_request = 8192;  // bytes, request line and headers together

struct HttpRequest {
  std::string method;
  std::string path;   // as sent, without the query
  std::string query;  // behind the ?, as sent
  std::string host;   // of the header Host, in lower case, without the port
  std::string token;  // of the header X-Sinerig-Token
  std::string last_event_id;
};

enum class Parsed {
  incomplete,  // more bytes are needed
  complete,
  malformed,  // answer 400
  too_long,   // answer 431
};

// Reads what has arrived so far. `request` is valid when the result is `complete`.
Parsed parse_request(std::string_view bytes, HttpRequest& request);

// The value of `name` in a query "a=1&b=2", empty where there is none; nothing is decoded.
std::string_view query_value(std::string_view query, std::string_view name);

// Compares without telling by its time how much was right.
bool same_secret(std::string_view given, std::string_view wanted);

}  // namespace sinerig::dashboard
