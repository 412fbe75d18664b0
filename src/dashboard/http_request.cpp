#include "dashboard/http_request.h"

#include <algorithm>
#include <cctype>

namespace sinerig::dashboard {

namespace {

constexpr std::string_view line_end = "\r\n";

bool visible(std::string_view text) {
  return std::all_of(text.begin(), text.end(),
                     [](unsigned char letter) { return letter > 0x20 && letter < 0x7f; });
}

std::string lower(std::string_view text) {
  std::string result{text};
  for (char& letter : result) {
    letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  }
  return result;
}

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char letter) {
    return letter == ' ' || letter == '\t';
  };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

// "localhost:8077" and "[::1]:8077" without the port.
std::string host_name(std::string_view host) {
  const std::size_t bracket = host.rfind(']');
  const std::size_t colon = host.rfind(':');
  if (colon != std::string_view::npos && (bracket == std::string_view::npos || colon > bracket))
    host = host.substr(0, colon);
  return lower(host);
}

bool take_request_line(std::string_view line, HttpRequest& request) {
  const std::size_t first = line.find(' ');
  const std::size_t last = line.rfind(' ');
  if (first == std::string_view::npos || first == last) return false;
  const std::string_view target = line.substr(first + 1, last - first - 1);
  const std::string_view protocol = line.substr(last + 1);
  if (protocol != "HTTP/1.1" && protocol != "HTTP/1.0") return false;
  if (target.empty() || target.front() != '/' || !visible(target)) return false;
  const std::size_t mark = target.find('?');
  request.method = line.substr(0, first);
  request.path = target.substr(0, mark);
  request.query = mark == std::string_view::npos ? "" : target.substr(mark + 1);
  return !request.method.empty() &&
         std::all_of(request.method.begin(), request.method.end(),
                     [](unsigned char letter) { return std::isupper(letter) != 0; });
}

bool take_header(std::string_view line, HttpRequest& request) {
  const std::size_t colon = line.find(':');
  if (colon == 0 || colon == std::string_view::npos) return false;
  const std::string_view name = line.substr(0, colon);
  const std::string_view value = trimmed(line.substr(colon + 1));
  if (!visible(name)) return false;
  const auto no_control = [](unsigned char letter) {
    return letter >= 0x20 && letter != 0x7f;
  };
  if (!std::all_of(value.begin(), value.end(), no_control)) return false;
  const std::string key = lower(name);
  if (key == "host") request.host = host_name(value);
  if (key == "x-sinerig-token") request.token = value;
  if (key == "last-event-id") request.last_event_id = value;
  return true;
}

}  // namespace

Parsed parse_request(std::string_view bytes, HttpRequest& request) {
  const std::size_t end = bytes.substr(0, longest_request).find("\r\n\r\n");
  if (end == std::string_view::npos) {
    return bytes.size() >= longest_request ? Parsed::too_long : Parsed::incomplete;
  }
  request = {};
  std::string_view head = bytes.substr(0, end);
  bool first = true;
  while (!head.empty()) {
    const std::size_t at = std::min(head.find(line_end), head.size());
    const std::string_view line = head.substr(0, at);
    if (!(first ? take_request_line(line, request) : take_header(line, request)))
      return Parsed::malformed;
    first = false;
    head.remove_prefix(std::min(at + line_end.size(), head.size()));
  }
  return first ? Parsed::malformed : Parsed::complete;
}

std::string_view query_value(std::string_view query, std::string_view name) {
  while (!query.empty()) {
    const std::size_t end = std::min(query.find('&'), query.size());
    const std::string_view each = query.substr(0, end);
    if (each.size() > name.size() && each.substr(0, name.size()) == name &&
        each[name.size()] == '=')
      return each.substr(name.size() + 1);
    query.remove_prefix(std::min(end + 1, query.size()));
  }
  return {};
}

bool same_secret(std::string_view given, std::string_view wanted) {
  unsigned different = given.size() == wanted.size() && !wanted.empty() ? 0U : 1U;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const char letter = i < given.size() ? given[i] : '\0';
    different |= static_cast<unsigned char>(letter ^ wanted[i]);
  }
  return different == 0;
}

}  // namespace sinerig::dashboard
