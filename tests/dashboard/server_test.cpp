// The loop never notices who watches: whatever clients do, the numbers are the same to the bit.
#include "dashboard/server.h"

#include <atomic>
#include <bit>
#include <memory>
#include <thread>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "support/http_client.h"
#include "support/served_run.h"

namespace sinerig::dashboard {
namespace {

using test::HttpClient;
using testing::HasSubstr;
using testing::Not;

constexpr const char* token = "00112233445566778899aabbccddeeff";

class ServerTest : public testing::Test {
 protected:
  explicit ServerTest(std::uint32_t points = 12) : plan_{test::served_plan(points)} {}

  std::uint16_t port() const { return server_->address().port; }

  SweepPlan plan_;
  Lateness lateness_;
  RunControl control_;
  LiveRun live_{test::served_setup(plan_), lateness_};
  std::unique_ptr<Server> server_ =
      std::make_unique<Server>(Server::Settings{.address = parse_address(":0"),
                                                .token = token,
                                                .stop =
                                                    [this] {
                                                      control_.stop_requests.fetch_add(1);
                                                    }},
                               live_);
};

TEST_F(ServerTest, AnswersWhatItKnowsAndRefusesTheRest) {
  EXPECT_THAT(HttpClient{port()}.get("/").rest(), HasSubstr("EventSource"));
  const std::string run = HttpClient{port()}.get("/run.json").rest();
  const auto json = nlohmann::json::parse(run.substr(run.find("\r\n\r\n")));
  EXPECT_EQ(json["dwells"], 12);
  EXPECT_EQ(json["responses"][0]["unit"], "(rad/s)/Nm");
  EXPECT_EQ(HttpClient{port()}.get("/etc/passwd").status(), "404");
  EXPECT_EQ(HttpClient{port()}.get("/../../etc/passwd").status(), "404");
  EXPECT_EQ(HttpClient{port()}.post("/").status(), "405");
  EXPECT_EQ(HttpClient{port()}.send("NONSENSE\r\n\r\n").status(), "400");
  EXPECT_EQ(HttpClient{port()}.send(std::string(9000, 'x')).status(), "431");
}

TEST_F(ServerTest, IsReadByNoOtherSite) {
  HttpClient rebound{port()};
  rebound.send("GET /run.json HTTP/1.1\r\nHost: evil.example\r\n\r\n");
  EXPECT_EQ(rebound.status(), "403");
  HttpClient numbered{port()};
  numbered.send("GET /run.json HTTP/1.1\r\nHost: 127.evil.example\r\n\r\n");
  EXPECT_EQ(numbered.status(), "403");
  HttpClient nameless{port()};
  nameless.send("GET /run.json HTTP/1.0\r\n\r\n");
  EXPECT_EQ(nameless.status(), "403");
  const std::string head =
      HttpClient{port()}.get("/run.json", "Origin: http://evil.example\r\n").rest();
  EXPECT_THAT(head, Not(HasSubstr("Access-Control-Allow-Origin")));
  EXPECT_THAT(head, HasSubstr("frame-ancestors 'none'"));
}

TEST_F(ServerTest, StopsForTheTokenOnly) {
  EXPECT_EQ(HttpClient{port()}.post("/stop").status(), "403");
  EXPECT_EQ(HttpClient{port()}.post("/stop", "X-Sinerig-Token: wrong\r\n").status(), "403");
  EXPECT_EQ(HttpClient{port()}.post(std::string{"/stop?token="} + token).status(), "403");
  EXPECT_EQ(
      HttpClient{port()}.get("/stop", std::string{"X-Sinerig-Token: "} + token + "\r\n").status(),
      "404");
  EXPECT_EQ(control_.stop_requests.load(), 0);
  EXPECT_EQ(
      HttpClient{port()}.post("/stop", std::string{"X-Sinerig-Token: "} + token + "\r\n").status(),
      "204");
  EXPECT_EQ(control_.stop_requests.load(), 1);
  const auto run = test::run_served(plan_, control_, &live_, lateness_);
  EXPECT_EQ(run.outcome.trip.cause, TripCause::stop_requested);
}

TEST_F(ServerTest, TellsTheWholeRunToWhoComesLate) {
  test::run_served(plan_, control_, &live_, lateness_);
  live_.finish({.outcome = "done", .detail = "", .files = {"axis.sweep"}});
  HttpClient client{port()};
  client.get("/events?since=0");
  ASSERT_TRUE(client.wait_for("event: end"));
  server_.reset();
  const std::string text = client.rest();
  EXPECT_THAT(text,
              HasSubstr(R"({"outcome":"done","outcome_text":"done","files":["axis.sweep"]})"));
  std::size_t points = 0;
  for (std::size_t at = text.find("data: {\"responses\""); at != std::string::npos;
       at = text.find("data: {\"responses\"", at + 1)) {
    const auto json = nlohmann::json::parse(text.substr(at + 6, text.find('\n', at) - at - 6));
    for (const auto& response : json["responses"]) points += response["f"].size();
  }
  EXPECT_EQ(points, 12U);
}

TEST_F(ServerTest, GoesOnWhereAReaderLeftOff) {
  test::run_served(plan_, control_, &live_, lateness_);
  live_.finish({.outcome = "done", .detail = "", .files = {}});
  std::size_t entries = 0;
  for (std::size_t next = 0; live_.log(entries, next); entries = next) {
  }
  HttpClient client{port()};
  client.get("/events?since=0",
             "Last-Event-ID: " + live_.id() + "-" + std::to_string(entries - 1) + "\r\n");
  ASSERT_TRUE(client.wait_for("event: end"));
  HttpClient ahead{port()};
  ahead.get("/events?since=99999999999999999999");
  EXPECT_TRUE(ahead.wait_for("event: status"));
  server_.reset();
  EXPECT_THAT(client.rest(), HasSubstr("id: " + live_.id() + "-" + std::to_string(entries) + "\n"));
}

// Whoever followed the run before on this port is not told of this one under its head.
TEST_F(ServerTest, SendsAReaderOfAnotherRunAway) {
  test::run_served(plan_, control_, &live_, lateness_);
  for (const char* request : {"/events?since=0123456789abcdef-0", "/events?since=0"}) {
    const bool foreign = std::string{request}.find('-') != std::string::npos;
    HttpClient client{port()};
    client.get(request, foreign ? "" : "Last-Event-ID: 0123456789abcdef-3\r\n");
    const std::string text = client.rest();
    EXPECT_THAT(text, HasSubstr("event: reload\n")) << request;
    EXPECT_THAT(text, Not(HasSubstr("event: log"))) << request;
  }
  HttpClient own{port()};
  own.get("/events?since=" + live_.id() + "-0");
  EXPECT_TRUE(own.wait_for("event: log"));
}

TEST_F(ServerTest, TellsHowOftenAStopWasAskedFor) {
  LiveSetup setup = test::served_setup(plan_);
  setup.stop_requests = [this] {
    return control_.stop_requests.load();
  };
  LiveRun run{std::move(setup), lateness_};
  EXPECT_EQ(nlohmann::json::parse(*run.status())["stop_requests"], 0);
  control_.stop_requests = 2;
  EXPECT_EQ(nlohmann::json::parse(*run.status())["stop_requests"], 2);
}

std::vector<std::uint64_t> bits_of(const record::StoredRun& run) {
  std::vector<std::uint64_t> bits;
  for (const record::StoredPoint& point : run.responses.at(0).points) {
    for (const double value :
         {point.frequency_hz, point.response.real(), point.response.imag(), point.covariance.re_re,
          point.covariance.re_im, point.covariance.im_im, point.dof, point.gain_interval_db,
          point.phase_interval_deg, point.snr_db, point.distortion, point.drift_per_s,
          point.samples, point.seconds})
      bits.push_back(std::bit_cast<std::uint64_t>(value));
  }
  return bits;
}

// As many clients as it takes to fill the server, none of them kind, and more knocking all the
// time.
TEST_F(ServerTest, HostileClientsChangeNoBit) {
  RunControl undisturbed;
  Lateness unread;
  const auto alone = test::run_served(plan_, undisturbed, nullptr, unread);
  ASSERT_EQ(alone.stored.responses.at(0).points.size(), 12U);

  std::vector<std::unique_ptr<HttpClient>> clients;
  for (std::size_t i = 0; i < 200; ++i) {
    clients.push_back(std::make_unique<HttpClient>(port()));
    ASSERT_TRUE(clients.back()->connected());
    switch (i % 5) {
      case 0: clients.back()->get("/events?since=0"); break;  // and never reads
      case 1: clients.back()->send("GET /eve"); break;        // and never ends
      case 2: clients.back()->send("\x16\x03\x01\x02nonsense\r\n\r\n"); break;
      case 3: clients.back()->post("/stop"); break;
      default: break;  // says nothing
    }
  }
  std::atomic<bool> over{false};
  std::thread knocking{[&] {
    while (!over.load()) HttpClient{port()}.get("/events?since=0").send("more\r\n\r\n");
  }};
  const auto watched = test::run_served(plan_, control_, &live_, lateness_);
  over.store(true);
  knocking.join();

  EXPECT_EQ(control_.stop_requests.load(), 0);
  EXPECT_EQ(watched.outcome.ticks, alone.outcome.ticks);
  EXPECT_EQ(bits_of(watched.stored), bits_of(alone.stored));
  // Those who only sat there lose their place to one who asks.
  clients.clear();
  EXPECT_EQ(HttpClient{port()}.get("/run.json").status(), "200");
}

// A client that takes nothing costs one socket: the answer to it is never more than one message.
TEST_F(ServerTest, StalledReaderHoldsUpNobody) {
  HttpClient stalled{port()};
  stalled.get("/events?since=0");
  test::run_served(plan_, control_, &live_, lateness_);
  live_.finish({.outcome = "done", .detail = "", .files = {}});
  HttpClient reader{port()};
  reader.get("/events?since=0");
  EXPECT_TRUE(reader.wait_for("event: end"));
}

// Whoever follows, or sits there, and however many do: a stop gets through.
class CrowdedServerTest : public ServerTest, public testing::WithParamInterface<int> {};

TEST_P(CrowdedServerTest, StopsAndAnswersBesideStreamsThatNobodyReads) {
  std::vector<std::unique_ptr<HttpClient>> streams;
  for (std::size_t i = 0; i < Server::most_streams; ++i) {
    streams.push_back(std::make_unique<HttpClient>(port(), GetParam()));
    streams.back()->get("/events?since=0");
    ASSERT_TRUE(streams.back()->wait_for("text/event-stream")) << i;
  }
  test::run_served(plan_, control_, &live_, lateness_);
  EXPECT_EQ(HttpClient{port()}.get("/events?since=0").status(), "503");
  std::vector<std::unique_ptr<HttpClient>> silent;
  for (std::size_t i = 0; i < Server::most_clients; ++i)
    silent.push_back(std::make_unique<HttpClient>(port()));
  EXPECT_EQ(
      HttpClient{port()}.post("/stop", std::string{"X-Sinerig-Token: "} + token + "\r\n").status(),
      "204");
  EXPECT_EQ(control_.stop_requests.load(), 1);
  EXPECT_EQ(HttpClient{port()}.get("/").status(), "200");
}

INSTANTIATE_TEST_SUITE_P(ReceiveBuffers, CrowdedServerTest, testing::Values(0, 2048));

TEST_F(ServerTest, SaysWhichAddressIsTaken) {
  LiveRun other{test::served_setup(plan_), lateness_};
  try {
    Server second{{.address = server_->address(),
                   .token = token,
                   .stop =
                       [] {
                       }},
                  other};
    ADD_FAILURE() << "two servers on one port";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr(server_->address().text() + ": Address already in use"));
  }
}

TEST(Token, IsLongAndNeverTheSame) {
  EXPECT_EQ(random_token().size(), 32U);
  EXPECT_NE(random_token(), random_token());
}

}  // namespace
}  // namespace sinerig::dashboard
