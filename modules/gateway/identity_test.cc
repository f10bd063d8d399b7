#include "gateway/identity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <stdexcept>

#include "files/text_file.h"
#include "gateway/admission.h"
#include "gateway/machine_names.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

constexpr int64_t kDay_s = 86'400;
constexpr int64_t kIssued_s = 1'700'000'000;
const MachineNames kNames{{"localhost", "robot.local"}, {"127.0.0.1", "192.168.1.7", "fd00::7"}};

TEST(Certificates, TheAuthorityVouchesForTheServer) {
  const Identity authority = MakeAuthority("Pangea hall", {}, kIssued_s);
  const MadeCertificate made = MakeServerCertificate(authority, kNames, kIssued_s);
  EXPECT_THAT(made.left_out, IsEmpty());
  EXPECT_TRUE(IsGoodFor(made.identity, authority, kNames, kIssued_s, 30));
  EXPECT_TRUE(IsGoodFor(made.identity, authority, kNames, kIssued_s, kServerDays - 1));
  EXPECT_FALSE(IsGoodFor(made.identity, authority, kNames, kIssued_s, kServerDays));
  EXPECT_LT(kServerDays + 1, 398) << "more than browsers take";
  EXPECT_FALSE(
      IsGoodFor(made.identity, MakeAuthority("Pangea hall", {}, kIssued_s), kNames, kIssued_s, 1));
  EXPECT_FALSE(IsGoodFor(made.identity, authority, {{}, {"192.168.1.8"}}, kIssued_s, 1));
  EXPECT_FALSE(IsGoodFor(made.identity, authority, {{"other.local"}, {}}, kIssued_s, 1));
  EXPECT_FALSE(IsGoodFor({"nonsense", "nonsense"}, authority, kNames, kIssued_s, 1));
}

// A phone that trusts it does not trust it for a bank.
TEST(Certificates, TheAuthorityVouchesForPrivateNetworksOnly) {
  const Identity authority =
      MakeAuthority("Pangea hall", {{"robot", "hall.example.org"}, {"8.8.8.7"}}, kIssued_s);
  const MachineNames names{
      {"robot", "hall.example.org", "a.lan", "bank.example.org", "example.org", "robot.evil"},
      {"10.1.2.3", "8.8.8.7", "8.8.8.8", "2001:db8::1", "fe80::1"}};
  const MadeCertificate made = MakeServerCertificate(authority, names, kIssued_s);
  EXPECT_THAT(made.left_out, UnorderedElementsAre("bank.example.org", "example.org", "robot.evil",
                                                  "8.8.8.8", "2001:db8::1"));
  EXPECT_TRUE(IsGoodFor(
      made.identity, authority,
      {{"robot", "hall.example.org", "a.lan"}, {"10.1.2.3", "8.8.8.7", "fe80::1"}}, kIssued_s, 1));
}

TEST(Certificates, SayWhenTheyExpire) {
  const Identity authority = MakeAuthority("Pangea hall", {}, kIssued_s);
  EXPECT_EQ(ExpiryOf(authority.certificate_chain_pem), kIssued_s + kAuthorityDays * kDay_s);
  EXPECT_THROW(ExpiryOf("nonsense"), std::runtime_error);
}

TEST(Certificates, HaveFingerprintsAndAFormForPhones) {
  const Identity authority = MakeAuthority("Pangea hall", {}, kIssued_s);
  const std::string fingerprint = Fingerprint(authority.certificate_chain_pem);
  EXPECT_EQ(fingerprint.size(), 32U * 3 - 1);
  EXPECT_NE(fingerprint,
            Fingerprint(MakeAuthority("Pangea hall", {}, kIssued_s).certificate_chain_pem));
  EXPECT_EQ(ToDer(authority.certificate_chain_pem).substr(0, 2), "\x30\x82") << "an ASN.1 sequence";
  EXPECT_THROW(Fingerprint("nonsense"), std::runtime_error);
}

class IdentityTest : public testing::Test {
 protected:
  IdentityTest() {
    fs::remove_all(folder_);
    site_ = site::OpenSite(folder_);
    MakeGatewayFolders(site_);
  }
  GatewayIdentity Open(int64_t now_s = kIssued_s, const MachineNames& names = kNames) {
    return OpenIdentity(site_, names, now_s);
  }

  const fs::path folder_ = testing::TempDir() + "/identity";
  site::Site site_;
};

TEST_F(IdentityTest, IsKeptAndItsKeysAreSecret) {
  const GatewayIdentity first = Open();
  const GatewayIdentity second = Open(kIssued_s + kDay_s);
  EXPECT_EQ(first.server.certificate_chain_pem, second.server.certificate_chain_pem);
  EXPECT_EQ(first.authority_pem, second.authority_pem);
  for (const char* key : {"ca.key", "server.key"}) {
    EXPECT_EQ(fs::status(site_.gateway() / key).permissions(),
              fs::perms::owner_read | fs::perms::owner_write)
        << key;
  }
}

TEST_F(IdentityTest, IsRenewedBeforeItRunsOutAndForNewAddresses) {
  const GatewayIdentity first = Open();
  const GatewayIdentity late = Open(kIssued_s + (kServerDays - 29) * kDay_s);
  EXPECT_NE(first.server.certificate_chain_pem, late.server.certificate_chain_pem);
  EXPECT_EQ(first.authority_pem, late.authority_pem) << "phones need not trust another";
  MachineNames moved = kNames;
  moved.addresses.emplace_back("192.168.2.7");
  const GatewayIdentity elsewhere = Open(kIssued_s + (kServerDays - 29) * kDay_s, moved);
  EXPECT_NE(late.server.certificate_chain_pem, elsewhere.server.certificate_chain_pem);
  moved.addresses.emplace_back("8.8.8.8");
  const GatewayIdentity partly = Open(kIssued_s + (kServerDays - 29) * kDay_s, moved);
  EXPECT_EQ(elsewhere.server.certificate_chain_pem, partly.server.certificate_chain_pem);
  EXPECT_THAT(partly.left_out, Contains("8.8.8.8"));
}

TEST_F(IdentityTest, IsRenewedWhileItIsUsedForTheSameNames) {
  MachineNames names = kNames;
  names.addresses.emplace_back("8.8.8.8");
  const GatewayIdentity first = Open(kIssued_s, names);
  EXPECT_FALSE(RenewIdentity(site_, first, kIssued_s + (kServerDays - 31) * kDay_s));
  const int64_t late_s = kIssued_s + (kServerDays - 30) * kDay_s;
  const auto renewed = RenewIdentity(site_, first, late_s);
  ASSERT_TRUE(renewed);
  EXPECT_TRUE(IsGoodFor(*renewed, {first.authority_pem, ""}, kNames, late_s, kServerDays - 1));
  EXPECT_EQ(Open(late_s).server.certificate_chain_pem, renewed->certificate_chain_pem);
}

// Phones trust the authority with which the gateway started.
TEST_F(IdentityTest, IsNotRenewedByAnotherAuthority) {
  const GatewayIdentity first = Open();
  fs::remove(site_.gateway() / "ca.pem");
  Open();
  try {
    RenewIdentity(site_, first, kIssued_s + kServerDays * kDay_s);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("ca.pem: is another one than at the start"));
  }
}

TEST_F(IdentityTest, SaysWhatIsWrongWithTheAuthority) {
  Open();
  const std::string key = ReadTextFile(site_.gateway() / "server.key");
  std::ofstream(site_.gateway() / "ca.key") << key;
  try {
    Open();
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("ca.pem: is too old, or of another key than ca.key"));
  }
}

// For instance on a machine without a battery for its clock.
TEST_F(IdentityTest, SaysThatTheClockIsBeforeTheAuthority) {
  Open();
  try {
    Open(kIssued_s - 10 * kDay_s);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("ca.pem: begins after the date of this machine"));
  }
}

TEST_F(IdentityTest, TheAddressIsToldToThoseWhoInvite) {
  EXPECT_THROW(ReadAddress(site_), std::runtime_error);
  WriteAddress(site_, {"https://192.168.1.7:8443/", "AB:CD"});
  EXPECT_EQ(ReadAddress(site_).url, "https://192.168.1.7:8443/");
  EXPECT_EQ(ReadAddress(site_).fingerprint, "AB:CD");
  std::ofstream(site_.gateway() / "address.json") << "{}";
  EXPECT_THROW(ReadAddress(site_), std::runtime_error);
}

TEST_F(IdentityTest, AnAddressThatCannotBeReadIsNotTakenForMissing) {
  // A link to itself fails for root, too, whom permissions do not stop.
  fs::create_symlink("address.json", site_.gateway() / "address.json");
  try {
    ReadAddress(site_);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("address.json: cannot be read: "));
  }
}

TEST(MachineNames, AreThoseOfThisMachine) {
  const MachineNames names = NamesOfThisMachine();
  EXPECT_THAT(names.hosts, Contains("localhost"));
  EXPECT_THAT(names.addresses, Contains("127.0.0.1"));
  EXPECT_THAT(names.addresses, Contains(AddressForOthers(names)));
}

TEST(MachineNames, WithoutIpv4OthersGetAnIpv6Address) {
  EXPECT_EQ(ReachableOf({{}, {"127.0.0.1", "::1", "fe80::1", "fd00::7"}}), "fd00::7");
  EXPECT_EQ(ReachableOf({{}, {"127.0.0.1", "fd00::7", "10.0.0.5"}}), "10.0.0.5");
  EXPECT_EQ(ReachableOf({{}, {"127.0.0.1", "::1", "fe80::1"}}), "127.0.0.1");
}

// Browsers look for an address among the certificate's addresses, not among its names.
TEST(MachineNames, AnAddressThatTheUserGivesIsNoName) {
  MachineNames names;
  for (const char* host : {"hall.example.org", "192.168.77.7", "fd00::9"}) {
    AddTo(&names, host);
  }
  EXPECT_THAT(names.hosts, ElementsAre("hall.example.org"));
  EXPECT_THAT(names.addresses, ElementsAre("192.168.77.7", "fd00::9"));
  for (const char* more :
       {"https://hall.example.org", "hall.example.org:443", "hall.example.org/"}) {
    EXPECT_THROW(AddTo(&names, more), std::runtime_error) << more;
  }
}

TEST(Certificates, AreForTheirNamesAndAddresses) {
  const MachineNames names{{"hall.example.org"}, {"192.168.77.7", "fd00::9"}};
  const Identity authority = MakeAuthority("Pangea", names, kIssued_s);
  const std::string made =
      MakeServerCertificate(authority, names, kIssued_s).identity.certificate_chain_pem;
  for (const char* name : {"hall.example.org", "192.168.77.7", "fd00::9"}) {
    EXPECT_TRUE(IsFor(made, name)) << name;
  }
  for (const char* name : {"example.org", "192.168.77.8", "::1", "127.0.0.1"}) {
    EXPECT_FALSE(IsFor(made, name)) << name;
  }
}

}  // namespace
}  // namespace pangea
