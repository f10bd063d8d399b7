// Tests pangea-server with its real processes.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "programs.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

// The server runs on buses that only this test uses.
std::string ServerCommand(const fs::path& folder) {
  const int port = 20000 + getpid() % 6000 * 2;
  const auto url = [](int at) {
    return fmt::format("'udpm://239.255.76.67:{}?ttl=0&recv_buf_size=4194304'", at);
  };
  return fmt::format("pangea-server --bus {} --link {} --journal {}/map.lcm --keys {}/keys",
                     url(port), url(port + 1), folder.string(), folder.string());
}

TEST(Server, RunsAllStartsAgainWhatDiesAndEndsInOrder) {
  const fs::path folder = FreshFolder("server");
  fs::create_directories(folder / "keys");
  fs::create_directories(folder / "options");
  std::ofstream(folder / "options" / "posegraph.yaml") << "{}\n";
  const std::string killed =
      "pgrep -f 'pangea-fusion.*" + std::to_string(20000 + getpid() % 6000 * 2) + "'";
  // The script is a file: else pgrep would find the shell itself by its command line.
  std::ofstream(folder / "run.sh") << fmt::format(
      "{} --options-dir {}/options & server=$!; sleep 3; kill -9 $({}); sleep 2; "
      "kill -INT $server; wait $server; echo exit code $?; "
      "pgrep -f {}/map.lcm || echo none is left\n",
      ServerCommand(folder), folder.string(), killed, folder.string());
  const Outcome outcome = RunCommand("sh " + (folder / "run.sh").string());
  for (const char* process : {"agent-handler", "place-recognition", "inter-map-ba", "fusion",
                              "posegraph", "global-ba", "map-points", "anchors"}) {
    EXPECT_THAT(outcome.output,
                testing::ContainsRegex(fmt::format("started .*pangea-{} ", process)));
  }
  EXPECT_THAT(outcome.output,
              HasSubstr(fmt::format("--options {}/options/posegraph.yaml", folder.string())));
  EXPECT_THAT(outcome.output, HasSubstr("fusion ended (signal 9"));
  EXPECT_THAT(outcome.output, HasSubstr("starting it again"));
  EXPECT_THAT(outcome.output, HasSubstr("ended\nexit code 0\n"));
  EXPECT_THAT(outcome.output, HasSubstr("none is left"));
  EXPECT_TRUE(fs::exists(folder / "map.lcm"));
  EXPECT_TRUE(fs::exists(folder / "map.lcm.logs" / "fusion.txt"));
}

TEST(Server, SaysWhichAgentsJoinAndWhichAreRefused) {
  const fs::path folder = FreshFolder("server_agents");
  const int port = 20000 + getpid() % 6000 * 2;
  const auto uplink = [&](int agent, const std::string& key) {
    return fmt::format(
        "timeout -s INT 9 pangea-uplink --agent {0} --key {1} --bus 'udpm://239.255.76.68:{2}' "
        "--link 'udpm://239.255.76.67:{3}?ttl=0&recv_buf_size=4194304' & up{0}=$!\n",
        agent, (folder / key).string(), port + agent % 2, port + 1);
  };
  std::ofstream(folder / "run.sh")
      << fmt::format(
             "pangea-agent-handler keygen --agent 1 --out {0}/keys/agent_1.key\n"
             "pangea-agent-handler keygen --agent 6 --out {0}/agent_6.key\n"
             "{1} & server=$!; sleep 2\n",
             folder.string(), ServerCommand(folder))
      << uplink(1, "keys/agent_1.key") << uplink(6, "agent_6.key")
      << fmt::format(
             "sleep 2; timeout -s INT 5 pangea-keyframe-player --agent 1 --rate 20 --bus "
             "'udpm://239.255.76.68:{}' --keyframes {}\n"
             "wait $up1 $up6; kill -INT $server; wait $server\n",
             port + 1, kSample);
  const Outcome outcome = RunCommand("sh " + (folder / "run.sh").string());
  for (const std::string& line :
       {std::string("agent 1 has joined"),
        std::string("agent 1 sends keyframes: the first is in the journal"),
        fmt::format("agent 6 is refused: the folder of keys, {}/keys, has no key for it",
                    folder.string())}) {
    const size_t at = outcome.output.find("\n" + line + "\n");
    EXPECT_NE(at, std::string::npos) << line << "\n" << outcome.output;
    EXPECT_EQ(outcome.output.find("\n" + line + "\n", at + 1), std::string::npos) << line;
  }
}

// In the second run the port of the server's own gateway is in use.
TEST(Server, StartsTheGatewayForPhonesAndEndsIfItCannot) {
  const fs::path folder = FreshFolder("server_phone");
  const int port = 20000 + getpid() % 6000 * 2;
  const std::string on_site = fmt::format(
      "--site {}/hall --bus 'udpm://239.255.76.67:{}?ttl=0&recv_buf_size=4194304' "
      "--link 'udpm://239.255.76.67:{}?ttl=0&recv_buf_size=4194304'",
      folder.string(), port, port + 1);
  std::ofstream(folder / "run.sh") << fmt::format(
      "pangea-server {0} --phone {2} & server=$!; for i in $(seq 100); do "
      "[ -e {1}/hall/gateway/address.json ] && break; sleep 0.1; done; "
      "pangea-gateway invite --site {1}/hall --name Anna; "
      "kill -INT $server; wait $server; echo exit code $?\n"
      "pangea-gateway {0} --port {2} & gateway=$!; sleep 2; "
      "timeout -s INT 60 pangea-server {0} --phone {2}; echo second exit code $?; kill $gateway\n",
      on_site, folder.string(), port);
  const Outcome outcome = RunCommand("sh " + (folder / "run.sh").string());
  EXPECT_THAT(outcome.output, testing::ContainsRegex("started .*pangea-gateway "));
  EXPECT_THAT(outcome.output, testing::ContainsRegex(fmt::format("https://.*:{}/#join=", port)));
  EXPECT_THAT(outcome.output, HasSubstr("ended\nexit code 0\n"));
  EXPECT_THAT(outcome.output,
              HasSubstr("give another port); given up after 3 times; the server ends"));
  EXPECT_THAT(outcome.output, HasSubstr("second exit code 1"));
}

// A script that prints the answer of the anchors' API to a page of the origin; `$1` is its port.
std::string AskAsPageOf(const std::string& origin) {
  return fmt::format(
      "exec 3<>/dev/tcp/127.0.0.1/$1; printf 'GET /v1/anchors HTTP/1.0\\r\\nHost: 127.0.0.1\\r\\n"
      "Origin: {}\\r\\n\\r\\n' >&3; cat <&3; echo\n",
      origin);
}

TEST(Server, LetsThePagesOfGivenOriginsUseTheAnchors) {
  const fs::path folder = FreshFolder("server_origins");
  fs::create_directories(folder / "keys");
  const int port = 20000 + getpid() % 6000 * 2;
  std::ofstream(folder / "ask.sh")
      << "for i in $(seq 100); do (: <>/dev/tcp/127.0.0.1/$1) 2>/dev/null && break; sleep 0.1; "
         "done\n"
      << AskAsPageOf("https://app.example") << AskAsPageOf("http://10.0.0.7:5173")
      << AskAsPageOf("https://elsewhere.example");
  std::ofstream(folder / "run.sh") << fmt::format(
      "{} --http 127.0.0.1:{} --allow-origin https://app.example --allow-origin "
      "http://10.0.0.7:5173 & server=$!; bash {}/ask.sh {}; kill -INT $server; wait $server\n",
      ServerCommand(folder), port, folder.string(), port);
  const Outcome outcome = RunCommand("sh " + (folder / "run.sh").string());
  EXPECT_THAT(outcome.output, HasSubstr("Access-Control-Allow-Origin: https://app.example\r\n"));
  EXPECT_THAT(outcome.output, HasSubstr("Access-Control-Allow-Origin: http://10.0.0.7:5173\r\n"));
  EXPECT_THAT(outcome.output, HasSubstr("Pages of other origins may not ask"));
  EXPECT_THAT(outcome.output, Not(HasSubstr("Access-Control-Allow-Origin: https://elsewhere")));
}

TEST(Server, AnswersAppsThatAskByAGivenName) {
  const fs::path folder = FreshFolder("server_names");
  fs::create_directories(folder / "keys");
  const int port = 20000 + getpid() % 6000 * 2;
  std::ofstream ask(folder / "ask.sh");
  ask << "for i in $(seq 100); do (: <>/dev/tcp/127.0.0.1/$1) 2>/dev/null && break; sleep 0.1; "
         "done\n";
  for (const char* host : {"hall.example", "elsewhere.example"}) {
    ask << fmt::format(
        "exec 3<>/dev/tcp/127.0.0.1/$1; printf 'GET /v1/openapi.json HTTP/1.0\\r\\nHost: {}\\r\\n"
        "\\r\\n' >&3; echo {}: $(head -n 1 <&3)\n",
        host, host);
  }
  ask.close();
  std::ofstream(folder / "run.sh") << fmt::format(
      "{} --http 127.0.0.1:{} --http-name hall.example & server=$!; bash {}/ask.sh {}; "
      "kill -INT $server; wait $server\n",
      ServerCommand(folder), port, folder.string(), port);
  const Outcome outcome = RunCommand("sh " + (folder / "run.sh").string());
  EXPECT_THAT(outcome.output, HasSubstr("\nhall.example: HTTP/1.0 200"));
  EXPECT_THAT(outcome.output, HasSubstr("\nelsewhere.example: HTTP/1.0 403"));
}

TEST(Server, RefusesOriginsThatAreNoneAndThoseOfNoApi) {
  const fs::path folder = FreshFolder("server_no_origins");
  fs::create_directories(folder / "keys");
  const std::string with_api = ServerCommand(folder) + " --http 127.0.0.1:0";
  for (const char* origin : {"app.example", "https://app.example/", "'*'"}) {
    const Outcome outcome = RunCommand(with_api + " --allow-origin " + origin);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_THAT(outcome.output, HasSubstr(": give scheme and host alone, as https://app.example"));
    EXPECT_THAT(outcome.output, Not(HasSubstr("started")));
  }
  const Outcome outcome = RunCommand(ServerCommand(folder) + " --allow-origin https://app.example");
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_THAT(outcome.output, HasSubstr("--allow-origin requires --http"));
}

TEST(Server, RefusesAnApiWithoutAddress) {
  const fs::path folder = FreshFolder("server_no_address");
  fs::create_directories(folder / "keys");
  for (const char* http : {"8090", ":8090", "127.0.0.1:", "127.0.0.1:65536", "127.0.0.1:x"}) {
    const Outcome outcome = RunCommand(ServerCommand(folder) + " --http " + http);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_THAT(outcome.output, HasSubstr(": give ADDRESS:PORT, as 127.0.0.1:8090"));
    EXPECT_THAT(outcome.output, Not(HasSubstr("started")));
  }
}

TEST(Server, GivesUpWhatCannotStartAndSaysWhy) {
  const fs::path folder = FreshFolder("server_keys");
  const Outcome outcome = RunCommand(ServerCommand(folder));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.output,
              HasSubstr("agent_handler ended (exit code 1: pangea-agent-handler: "));
  EXPECT_THAT(outcome.output, HasSubstr("given up after 3 times"));
}

// A checkpoint that ends its process would do so at each start.
TEST(Server, RemovesTheCheckpointOfWhatItGivesUp) {
  const fs::path folder = FreshFolder("server_checkpoint");
  for (const char* name : {"keys", "map.lcm.checkpoints"}) {
    fs::create_directories(folder / name);
  }
  for (const char* process : {"posegraph", "fusion"}) {
    std::ofstream(folder / "map.lcm.checkpoints" / process) << "bad";
  }
  std::ofstream(folder / "bad.yaml") << "no_such_option: 1\n";
  const Outcome outcome =
      RunCommand(ServerCommand(folder) + " --options posegraph=" + (folder / "bad.yaml").string());
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.output, HasSubstr("removed the checkpoint of posegraph"));
  EXPECT_FALSE(fs::exists(folder / "map.lcm.checkpoints" / "posegraph"));
  EXPECT_TRUE(fs::exists(folder / "map.lcm.checkpoints" / "fusion"));
}

TEST(Server, OfSeveralHostsSaysWhatItLacks) {
  const fs::path folder = FreshFolder("server_hosts");
  fs::create_directories(folder / "keys");
  EXPECT_THAT(RunCommand("pangea-server --worker hall").output,
              HasSubstr("--worker: give --nats with the URL of the site's NATS"));
  EXPECT_THAT(RunCommand(ServerCommand(folder) + " --nats nats://127.0.0.1:1").output,
              HasSubstr("--nats: give --site FOLDER, whose name the site has there"));
}

TEST(Server, RefusesOptionsOfNoProcessAndOptionsThatAreNotThere) {
  const fs::path folder = FreshFolder("server_options");
  Outcome outcome = RunCommand(ServerCommand(folder) + " --options fushion=/dev/null");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.output, HasSubstr("PROCESS one of agent_handler, place_recognition"));
  outcome = RunCommand(ServerCommand(folder) + " --options fusion=/not/there.yaml");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.output, HasSubstr("there is no file /not/there.yaml"));
  outcome = RunCommand(ServerCommand(folder) + " --options-dir /not/there");
  EXPECT_THAT(outcome.output, HasSubstr("there is no such folder"));
  fs::create_directories(folder / "options");
  for (const char* name : {"fushion.yaml", "posegraph.yml", "anchors.yaml", "thinning.yaml"}) {
    std::ofstream(folder / "options" / name) << "{}\n";
  }
  outcome = RunCommand(ServerCommand(folder) + " --options-dir " + (folder / "options").string() +
                       " --options fusion=/not/there.yaml");
  EXPECT_THAT(outcome.output, HasSubstr("fushion.yaml: no process reads it; did you mean "
                                        "'fusion.yaml'?"));
  EXPECT_THAT(outcome.output, HasSubstr("posegraph.yml: no process reads it"));
  EXPECT_THAT(outcome.output, Not(HasSubstr("anchors.yaml: no")));
  EXPECT_THAT(outcome.output, Not(HasSubstr("thinning.yaml: no")));
}

}  // namespace
}  // namespace pangea::tests
