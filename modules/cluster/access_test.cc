// Tests the files of packaging/pangea-nats-config with a real nats-server: TLS, users, permissions.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <thread>

#include "bus/status_log.h"
#include "cluster/bridge_test_world.h"
#include "files/text_file.h"
#include "files/whole_file.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

using testing::HasSubstr;
using testing::IsEmpty;

class Access : public testing::Test {
 protected:
  explicit Access(std::string host = "127.0.0.1", const std::string& folder = "127.0.0.1")
      : host_(std::move(host)), place_(fmt::format("{}_{}", folder, port_)) {}
  void SetUp() override {
    if (NatsServerProgram().empty()) {
      GTEST_SKIP() << "nats-server is not installed: scripts/setup scripts/packages_cluster.txt";
    }
    fs::remove_all(folder_);
    ASSERT_EQ(std::system(fmt::format("{}/packaging/pangea-nats-config --sites hall --hosts {} "
                                      "--out {} > /dev/null",
                                      PANGEA_SOURCE_DIR, Host(), folder_.string())
                              .c_str()),
              0);
    server_ = std::make_unique<Program>(std::vector<std::string>{
        NatsServerProgram(), "-c", folder_ / place_ / "nats.conf", "-l", folder_ / "log"});
    for (int i = 0; i < 100 && !Why(As("core")).empty(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }
  std::string Host() const { return fmt::format("{}:{}", host_, port_); }
  NatsAccess As(const std::string& role) const {
    return {"tls://" + Host(), folder_ / "ca.pem", folder_ / (role + "-hall.credentials")};
  }
  // Why not; empty: connected.
  static std::string Why(const NatsAccess& access) {
    try {
      SiteStreams(access, "hall");
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  static bool Hears(SiteStreams& streams, SiteStreams::Kind kind) {
    for (int i = 0; i < 100; ++i) {
      if (streams.HeardOfStored(kind)) {
        return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return false;
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / "cluster_access";
  const int port_ = FreePort();
  const std::string host_, place_;
  std::unique_ptr<Program> server_;
};

TEST_F(Access, CoreAndWorkerComeInAndNobodyElse) {
  EXPECT_THAT(Why(As("core")), IsEmpty());
  EXPECT_THAT(Why(As("worker")), IsEmpty());
  NatsAccess plain = As("worker");
  plain.url = fmt::format("nats://127.0.0.1:{}", port_);
  EXPECT_THAT(Why(plain), HasSubstr("would show the password to the network"));
  plain.credentials.clear();
  EXPECT_THAT(Why(plain), HasSubstr("takes TLS only: give --nats tls://"));
  NatsAccess nobody = As("worker");
  nobody.credentials.clear();
  EXPECT_THAT(Why(nobody), HasSubstr("wants a user and a password: give --credentials"));
  NatsAccess without_authority = As("worker");
  without_authority.ca.clear();
  EXPECT_THAT(Why(without_authority), HasSubstr("and with it --ca FILE"));
}

class AccessByIpv6 : public Access {
 protected:
  AccessByIpv6() : Access("[::1]", "__1") {}
};

TEST_F(AccessByIpv6, CoreAndWorkerComeIn) {
  EXPECT_THAT(Why(As("core")), IsEmpty());
  EXPECT_THAT(Why(As("worker")), IsEmpty());
}

TEST_F(Access, AWrongPasswordIsRefused) {
  NatsAccess access = As("worker");
  access.credentials = folder_ / "wrong.credentials";
  WriteNewFile(access.credentials, "user: worker-hall\npassword: 1234\n", kOwnerOnly);
  EXPECT_THAT(Why(access), HasSubstr("refuses the user of " + access.credentials.string()));
}

TEST_F(Access, CredentialsThatOthersCanReadAreNotUsed) {
  fs::permissions(As("worker").credentials, fs::perms::group_read, fs::perm_options::add);
  EXPECT_THAT(Why(As("worker")), HasSubstr("others can read the password: chmod 600"));
}

TEST_F(Access, AServerOfAnotherAuthorityIsNotTrusted) {
  const fs::path other = folder_ / "other";
  ASSERT_EQ(std::system(fmt::format("{}/packaging/pangea-nats-config --sites hall --hosts "
                                    "127.0.0.1 --out {} > /dev/null",
                                    PANGEA_SOURCE_DIR, other.string())
                            .c_str()),
            0);
  NatsAccess access = As("worker");
  access.ca = other / "ca.pem";
  EXPECT_THAT(Why(access), HasSubstr("certificate is not of the authority in"));
}

TEST_F(Access, ASiteOfAnotherUserIsRefusedWithTheReason) {
  testing::internal::CaptureStderr();
  StartLog("test", "");
  SiteStreams attic(As("worker"), "attic");
  EXPECT_FALSE(attic.AreThere());
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_THAT(said,
              testing::ContainsRegex("STREAM.INFO.pangea-attic-result.*--credentials of this"));
}

TEST_F(Access, AWorkerStoresResultsAndNothingElse) {
  SiteStreams core(As("core"), "hall");
  core.Make();
  const std::vector<uint8_t> data{1, 2, 3};
  ASSERT_EQ(core.StoreEvent("OPTIONS_fusion", 7, data, 0).stored, SiteStreams::Stored::kNew);
  SiteStreams worker(As("worker"), "hall");
  worker.ListenToStored(SiteStreams::Kind::kMatch);
  core.ListenToStored(SiteStreams::Kind::kResult);
  // A round trip of each: what comes after it in the server comes after its subscription.
  EXPECT_TRUE(worker.AreThere());
  EXPECT_TRUE(core.AreThere());
  Constraint result;
  result.from = {{1, 5}, 3};
  result.to = {{2, 6}, 4};
  EXPECT_EQ(worker.Store(worker.EntryOf(result)), SiteStreams::Stored::kNew);
  EXPECT_TRUE(worker.FindResult(result.to, result.Id()).has_value());
  EXPECT_TRUE(worker.EventAt(1).has_value()) << "it reads the journal";
  EXPECT_EQ(worker.StoreEvent("KEYFRAME_1", 7, data, 1).stored, SiteStreams::Stored::kUnreachable);
  PlaceMatch match;
  match.query = result.to;
  EXPECT_EQ(worker.Store(worker.EntryOf(match)), SiteStreams::Stored::kUnreachable);
  EXPECT_EQ(worker.StoreLease("worker", 0).stored, SiteStreams::Stored::kUnreachable);
  EXPECT_EQ(core.JournalEnd(), 1u);
  EXPECT_EQ(core.LeaseSequence(), 0u);
  EXPECT_EQ(core.Store(core.EntryOf(match)), SiteStreams::Stored::kNew);
  EXPECT_TRUE(Hears(worker, SiteStreams::Kind::kMatch));
  EXPECT_TRUE(Hears(core, SiteStreams::Kind::kResult));
  const auto delivery = worker.FetchMatch();
  ASSERT_TRUE(delivery.has_value());
  EXPECT_TRUE(worker.Acknowledge(delivery->ack_subject));
}

TEST_F(Access, AnEdgeCarriesPacketsOfTheLinkAndNothingElse) {
  SiteStreams core(As("core"), "hall");
  core.Make();
  ASSERT_EQ(core.StoreEvent("OPTIONS_fusion", 7, std::vector<uint8_t>{1}, 0).stored,
            SiteStreams::Stored::kNew);
  SiteStreams as_edge(As("edge"), "hall");
  EXPECT_FALSE(as_edge.EventAt(1).has_value());
  EXPECT_FALSE(as_edge.AreThere());
  NatsClient server(As("core"), "server"), edge(As("edge"), "edge"), other(As("edge"), "other");
  server.Listen("pangea.hall.link.up.*");
  other.Listen("pangea.hall.link.down.*");
  const auto hears = [](NatsClient& client, const std::string& subject) {
    std::optional<NatsClient::Heard> heard;
    for (int i = 0; i < 50 && !heard; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      heard = client.NextHeard(subject);
    }
    return heard ? heard->subject : "";
  };
  EXPECT_EQ(hears(server, "pangea.hall.link.up.*"), "");
  const std::vector<uint8_t> packet{1, 2};
  edge.Publish("pangea.hall.link.down.7", packet);
  edge.Publish("pangea.hall.link.up.7", packet);
  EXPECT_EQ(hears(server, "pangea.hall.link.up.*"), "pangea.hall.link.up.7");
  EXPECT_EQ(hears(other, "pangea.hall.link.down.*"), "");
  server.Publish("pangea.hall.link.down.7", packet);
  EXPECT_EQ(hears(other, "pangea.hall.link.down.*"), "pangea.hall.link.down.7");
}

// Its key is kept on no host; without it, a further host would get another authority than the
// others have.
TEST(NatsConfig, AnAuthorityIsNotReplacedWhenItsKeyIsElsewhere) {
  const fs::path folder = fs::path(testing::TempDir()) / "cluster_authority";
  fs::remove_all(folder);
  const auto make = [&folder](const std::string& host) {
    return std::system(fmt::format("{}/packaging/pangea-nats-config --sites hall --hosts {} "
                                   "--out {} > /dev/null 2>&1",
                                   PANGEA_SOURCE_DIR, host, folder.string())
                           .c_str());
  };
  ASSERT_EQ(make("10.0.0.1"), 0);
  const std::string authority = ReadTextFile(folder / "ca.pem");
  fs::rename(folder / "ca.key", folder / "elsewhere.key");
  EXPECT_NE(make("10.0.0.2"), 0);
  EXPECT_EQ(ReadTextFile(folder / "ca.pem"), authority);
  fs::rename(folder / "elsewhere.key", folder / "ca.key");
  EXPECT_EQ(make("10.0.0.2"), 0);
  EXPECT_EQ(ReadTextFile(folder / "ca.pem"), authority);
}

TEST(NatsConfig, AnIpv6AddressWithoutBracketsIsRefusedWithTheMend) {
  const std::string out = testing::TempDir() + "cluster_ipv6.txt";
  EXPECT_NE(std::system(fmt::format("{}/packaging/pangea-nats-config --sites hall --hosts ::1 "
                                    "--out {}.folder > {} 2>&1",
                                    PANGEA_SOURCE_DIR, out, out)
                            .c_str()),
            0);
  EXPECT_THAT(ReadTextFile(out), HasSubstr("an IPv6 address in brackets"));
}

}  // namespace
}  // namespace pangea
