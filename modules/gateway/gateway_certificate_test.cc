// The certificate of a gateway that runs for years.

#include <fmt/chrono.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "files/text_file.h"
#include "gateway/test_gateway_process.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

// The certificate that a new connection gets.
class CertificateTest : public GatewayProcessTest {
 protected:
  std::string Certificate() {
    web::TlsClient client(process_->port());
    for (int i = 0; i < 10 && client.certificate().empty(); ++i) {
      Serve(1);
    }
    return client.certificate();
  }
  // Writes a certificate that a user brings, valid for so many days more; returns its file.
  std::string WriteOwn(int days) {
    const int64_t made_s = Date() - (kServerDays - days) * (kDay / kSecond);
    const Identity own =
        MakeServerCertificate(MakeAuthority("own", {}, made_s), kNames, made_s).identity;
    WriteFile("own.pem", own.certificate_chain_pem);
    WriteFile("own.key", own.private_key_pem);
    return (folder_ / "own.pem").string();
  }
  void WriteFile(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
  }
};

TEST_F(CertificateTest, IsRenewedWhileTheGatewayRuns) {
  GatewayAgent anna(process_->port(), 5, NewKey(5));
  for (int i = 0; i < 10 && !anna.proven(); ++i) {
    Serve(2);
    anna.Received();
  }
  Serve();
  const std::string first = Certificate();
  Skip((kServerDays - 31) * kDay);
  EXPECT_EQ(Certificate(), first);
  Skip(2 * kDay);
  const std::string second = Certificate();
  EXPECT_NE(second, first);
  EXPECT_TRUE(IsGoodFor({second, ReadTextFile(site_.gateway() / "server.key")},
                        {identity_.authority_pem, ""}, kNames, Date(), kServerDays - 2));
  EXPECT_EQ(ReadTextFile(site_.gateway() / "server.pem").substr(0, second.size()), second);
  Skip(kServerDays * kDay);
  EXPECT_NE(Certificate(), second);
  anna.Send(std::vector<uint8_t>{1, 2, 3});
  Serve();
  EXPECT_THAT(up_, ElementsAre(testing::Pair("LINK_UP_5", "\1\2\3"))) << "the link was cut";
}

TEST_F(CertificateTest, StaysWhileItCannotBeRenewed) {
  const std::string first = Certificate();
  fs::remove(site_.gateway() / "ca.key");
  Skip((kServerDays - 29) * kDay);
  EXPECT_EQ(Certificate(), first);
  EXPECT_GE(NumRefused((site_.gateway() / "ca.key").string()), 1);
}

TEST_F(CertificateTest, OfTheUserIsOnlyWarnedAbout) {
  const std::string file = WriteOwn(31);
  Open(ReadIdentity(file, (folder_ / "own.key").string()));
  const std::string first = Certificate();
  EXPECT_THAT(status_.refused, IsEmpty());
  Skip(2 * kDay);
  const std::string date = fmt::format("{:%Y-%m-%d}", fmt::gmtime(ExpiryOf(first)));
  EXPECT_EQ(NumRefused(fmt::format("{}: this certificate expires on {}", file, date)), 1);
  Skip(30 * kDay);
  EXPECT_EQ(NumRefused(fmt::format("{}: this certificate has expired on {}", file, date)), 1);
  EXPECT_EQ(Certificate(), first);
}

}  // namespace
}  // namespace pangea
