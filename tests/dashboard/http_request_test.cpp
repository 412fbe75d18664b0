#include "dashboard/http_request.h"

#include <random>

#include <gtest/gtest.h>

#include "support/parameters.h"

namespace sinerig::dashboard {
namespace {

TEST(HttpRequest, TakesWhatThePageSends) {
  HttpRequest request;
  const std::string text =
      "POST /stop?a=1&since=42 HTTP/1.1\r\nHost: LocalHost:8077\r\nx-sinerig-TOKEN:  abc \r\n"
      "Last-Event-ID: 7\r\nAccept: */*\r\n\r\nbody";
  ASSERT_EQ(parse_request(text, request), Parsed::complete);
  EXPECT_EQ(request.method, "POST");
  EXPECT_EQ(request.path, "/stop");
  EXPECT_EQ(query_value(request.query, "since"), "42");
  EXPECT_EQ(query_value(request.query, "sin"), "");
  EXPECT_EQ(request.host, "localhost");
  EXPECT_EQ(request.token, "abc");
  EXPECT_EQ(request.last_event_id, "7");
}

TEST(HttpRequest, WaitsForTheRest) {
  const std::string text = "GET / HTTP/1.1\r\nHost: [::1]:8077\r\n\r\n";
  HttpRequest request;
  for (std::size_t length = 0; length < text.size(); ++length)
    EXPECT_EQ(parse_request(text.substr(0, length), request), Parsed::incomplete) << length;
  EXPECT_EQ(parse_request(text, request), Parsed::complete);
  EXPECT_EQ(request.host, "[::1]");
}

TEST(HttpRequest, RefusesWhatIsNone) {
  for (const char* text :
       {"\r\n\r\n", "GET /\r\n\r\n", "GET  HTTP/1.1\r\n\r\n", "GET / HTTP/2\r\n\r\n",
        "get / HTTP/1.1\r\n\r\n", "GET http://a/ HTTP/1.1\r\n\r\n", "GET /\x01 HTTP/1.1\r\n\r\n",
        "GET / HTTP/1.1\r\nno colon\r\n\r\n", "GET / HTTP/1.1\r\n: empty\r\n\r\n",
        "GET / HTTP/1.1\r\nX Y: space\r\n\r\n", "GET / HTTP/1.1\r\nHost: a\nb\r\n\r\n"}) {
    HttpRequest request;
    EXPECT_EQ(parse_request(text, request), Parsed::malformed) << text;
  }
  HttpRequest request;
  EXPECT_EQ(parse_request(std::string(longest_request, 'A'), request), Parsed::too_long);
  const std::string late_end =
      "GET / HTTP/1.1\r\nX: " + std::string(longest_request, 'a') + "\r\n\r\n";
  EXPECT_EQ(parse_request(late_end, request), Parsed::too_long);
}

// Any bytes at all: an answer, and nothing read that was not sent.
TEST(HttpRequest, SurvivesRandomBytes) {
  std::mt19937_64 random{test::seed(7)};
  using namespace std::string_literals;
  const std::string alphabet = "GET /PSTHost:XinergTk-= HTP/1.0?&\r\n\r\n\0\x80\xff"s;
  for (std::uint64_t i = 0; i < test::count(20000); ++i) {
    std::string text = i % 2 == 0 ? "GET / HTTP/1.1\r\n" : "";
    for (std::size_t n = random() % 60; n > 0; --n) text += alphabet[random() % alphabet.size()];
    text += i % 3 == 0 ? "\r\n\r\n" : "";
    HttpRequest request;
    if (parse_request(text, request) != Parsed::complete) continue;
    EXPECT_NE(text.find(request.path), std::string::npos);
    EXPECT_EQ(request.path.front(), '/');
  }
}

TEST(HttpRequest, TokenHasToBeRightToTheLastLetter) {
  EXPECT_TRUE(same_secret("0123abcd", "0123abcd"));
  for (const char* wrong : {"", "0123abce", "0123abc", "0123abcd0", "1123abcd"})
    EXPECT_FALSE(same_secret(wrong, "0123abcd")) << wrong;
  EXPECT_FALSE(same_secret("", "")) << "a server without a token stops for nobody";
}

}  // namespace
}  // namespace sinerig::dashboard
