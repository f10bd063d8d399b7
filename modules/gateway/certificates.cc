#include "gateway/certificates.h"

#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509.h>
#include <openssl/x509_vfy.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <memory>
#include <stdexcept>

namespace pangea {
namespace {

template <auto Free>
struct Freer {
  template <typename T>
  void operator()(T* what) const {
    Free(what);
  }
};
using Certificate = std::unique_ptr<X509, Freer<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Freer<EVP_PKEY_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, Freer<X509_EXTENSION_free>>;
using Memory = std::unique_ptr<BIO, Freer<BIO_free_all>>;
using Store = std::unique_ptr<X509_STORE, Freer<X509_STORE_free>>;
using StoreContext = std::unique_ptr<X509_STORE_CTX, Freer<X509_STORE_CTX_free>>;

constexpr int64_t kDay_s = 86'400;
constexpr const char* kPrivateHosts[] = {"localhost", "local", "lan", "internal", "home.arpa"};
constexpr const char* kPrivateNetworks[] = {"127.0.0.0/255.0.0.0",
                                            "10.0.0.0/255.0.0.0",
                                            "172.16.0.0/255.240.0.0",
                                            "192.168.0.0/255.255.0.0",
                                            "169.254.0.0/255.255.0.0",
                                            "100.64.0.0/255.192.0.0",
                                            "::1/ffff:ffff:ffff:ffff:ffff:ffff:ffff:ffff",
                                            "fc00::/fe00::",
                                            "fe80::/ffc0::"};

void Check(bool done, const char* what) {
  if (!done) {
    const unsigned long error = ERR_get_error();
    ERR_clear_error();
    throw std::runtime_error(fmt::format(
        "OpenSSL: {}: {}", what, error == 0 ? "no reason" : ERR_reason_error_string(error)));
  }
}

Memory MemoryOf(const std::string& text) {
  return Memory(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

Certificate ReadCertificate(const std::string& pem) {
  Certificate read(PEM_read_bio_X509(MemoryOf(pem).get(), nullptr, nullptr, nullptr));
  Check(read != nullptr, "this is no certificate in PEM");
  return read;
}

Key ReadKey(const std::string& pem) {
  Key read(PEM_read_bio_PrivateKey(MemoryOf(pem).get(), nullptr, nullptr, nullptr));
  Check(read != nullptr, "this is no private key in PEM");
  return read;
}

std::string TextOf(BIO* memory) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(memory, &data);
  return {data, static_cast<size_t>(size)};
}

std::string ToPem(X509* certificate) {
  const Memory memory(BIO_new(BIO_s_mem()));
  Check(PEM_write_bio_X509(memory.get(), certificate) == 1, "a certificate");
  return TextOf(memory.get());
}

std::string ToPem(EVP_PKEY* key) {
  const Memory memory(BIO_new(BIO_s_secmem()));
  Check(
      PEM_write_bio_PKCS8PrivateKey(memory.get(), key, nullptr, nullptr, 0, nullptr, nullptr) == 1,
      "a key");
  return TextOf(memory.get());
}

int64_t SecondsOf(const ASN1_TIME* time) {
  std::tm parts{};
  Check(ASN1_TIME_to_tm(time, &parts) == 1, "a time");
  return timegm(&parts);
}

// The values of an extension as text: "a,b".
std::string Joined(const std::vector<std::string>& values) {
  return fmt::format("{}", fmt::join(values, ","));
}

void AddExtension(X509* certificate, X509* issuer, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const Extension extension(X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str()));
  Check(extension != nullptr && X509_add_ext(certificate, extension.get(), -1) == 1, value.c_str());
}

// A certificate with a random serial number. It is valid from a day ago, because clocks differ.
Certificate NewCertificate(const std::string& name, EVP_PKEY* key, int64_t now_s, int days) {
  Certificate made(X509_new());
  std::array<uint8_t, 16> number{};
  Check(RAND_bytes(number.data(), static_cast<int>(number.size())) == 1, "random bytes");
  number[0] = static_cast<uint8_t>((number[0] & 0x7f) | 0x40);  // positive, without leading zeros
  const std::unique_ptr<BIGNUM, Freer<BN_free>> big(
      BN_bin2bn(number.data(), static_cast<int>(number.size()), nullptr));
  Check(X509_set_version(made.get(), X509_VERSION_3) == 1 &&
            BN_to_ASN1_INTEGER(big.get(), X509_get_serialNumber(made.get())) != nullptr &&
            ASN1_TIME_set(X509_getm_notBefore(made.get()), now_s - kDay_s) != nullptr &&
            ASN1_TIME_set(X509_getm_notAfter(made.get()), now_s + days * kDay_s) != nullptr &&
            X509_set_pubkey(made.get(), key) == 1 &&
            X509_NAME_add_entry_by_txt(X509_get_subject_name(made.get()), "CN", MBSTRING_UTF8,
                                       reinterpret_cast<const unsigned char*>(name.data()),
                                       static_cast<int>(name.size()), -1, 0) == 1,
        "a new certificate");
  return made;
}

void Sign(X509* certificate, EVP_PKEY* key) {
  Check(X509_sign(certificate, key, EVP_sha256()) > 0, "signing");
}

// The address with a mask that allows only this address.
std::string OneAddress(const std::string& address) {
  return address + (address.find(':') == std::string::npos
                        ? "/255.255.255.255"
                        : "/ffff:ffff:ffff:ffff:ffff:ffff:ffff:ffff");
}

std::string ConstraintsOf(const MachineNames& names) {
  std::vector<std::string> permitted{"critical"};
  for (const char* host : kPrivateHosts) {
    permitted.push_back(fmt::format("permitted;DNS:{}", host));
  }
  for (const char* network : kPrivateNetworks) {
    permitted.push_back(fmt::format("permitted;IP:{}", network));
  }
  for (const std::string& host : names.hosts) {
    permitted.push_back(fmt::format("permitted;DNS:{}", host));
  }
  for (const std::string& address : names.addresses) {
    permitted.push_back(fmt::format("permitted;IP:{}", OneAddress(address)));
  }
  return Joined(permitted);
}

Identity SignServer(const Identity& authority, const std::vector<std::string>& alternatives,
                    int64_t now_s) {
  const Certificate issuer = ReadCertificate(authority.certificate_chain_pem);
  const Key issuer_key = ReadKey(authority.private_key_pem);
  const Key key(EVP_EC_gen("P-256"));
  Check(key != nullptr, "a new key");
  const Certificate made = NewCertificate("Pangea gateway", key.get(), now_s, kServerDays);
  X509_set_issuer_name(made.get(), X509_get_subject_name(issuer.get()));
  AddExtension(made.get(), issuer.get(), NID_basic_constraints, "critical,CA:FALSE");
  AddExtension(made.get(), issuer.get(), NID_key_usage, "critical,digitalSignature");
  AddExtension(made.get(), issuer.get(), NID_ext_key_usage, "serverAuth");
  AddExtension(made.get(), issuer.get(), NID_subject_key_identifier, "hash");
  AddExtension(made.get(), issuer.get(), NID_authority_key_identifier, "keyid:always");
  AddExtension(made.get(), issuer.get(), NID_subject_alt_name, Joined(alternatives));
  Sign(made.get(), issuer_key.get());
  return {ToPem(made.get()) + authority.certificate_chain_pem, ToPem(key.get())};
}

bool Verifies(X509* certificate, X509* authority, int64_t at_s) {
  const Store store(X509_STORE_new());
  const StoreContext context(X509_STORE_CTX_new());
  if (X509_STORE_add_cert(store.get(), authority) != 1 ||
      X509_STORE_CTX_init(context.get(), store.get(), certificate, nullptr) != 1) {
    return false;
  }
  X509_STORE_CTX_set_time(context.get(), 0, at_s);
  X509_STORE_CTX_set_purpose(context.get(), X509_PURPOSE_SSL_SERVER);
  return X509_verify_cert(context.get()) == 1;
}

bool MayVouchFor(const Identity& authority, const std::string& alternative, int64_t now_s) {
  const Identity probe = SignServer(authority, {alternative}, now_s);
  return Verifies(ReadCertificate(probe.certificate_chain_pem).get(),
                  ReadCertificate(authority.certificate_chain_pem).get(), now_s);
}

}  // namespace

Identity MakeAuthority(const std::string& name, const MachineNames& names, int64_t now_s) {
  const Key key(EVP_EC_gen("P-256"));
  Check(key != nullptr, "a new key");
  constexpr size_t kMaxCommonName = 64;
  const Certificate made =
      NewCertificate(name.substr(0, kMaxCommonName), key.get(), now_s, kAuthorityDays);
  X509_set_issuer_name(made.get(), X509_get_subject_name(made.get()));
  AddExtension(made.get(), made.get(), NID_basic_constraints, "critical,CA:TRUE,pathlen:0");
  AddExtension(made.get(), made.get(), NID_key_usage, "critical,keyCertSign,cRLSign");
  AddExtension(made.get(), made.get(), NID_subject_key_identifier, "hash");
  AddExtension(made.get(), made.get(), NID_name_constraints, ConstraintsOf(names));
  Sign(made.get(), key.get());
  return {ToPem(made.get()), ToPem(key.get())};
}

bool CanVouch(const Identity& authority, int64_t now_s, int days) {
  const Certificate certificate = ReadCertificate(authority.certificate_chain_pem);
  std::time_t end_s = now_s + days * kDay_s;
  return X509_check_private_key(certificate.get(), ReadKey(authority.private_key_pem).get()) == 1 &&
         X509_cmp_time(X509_get0_notAfter(certificate.get()), &end_s) > 0;
}

MadeCertificate MakeServerCertificate(const Identity& authority, const MachineNames& names,
                                      int64_t now_s) {
  MadeCertificate made;
  std::vector<std::string> alternatives;
  const auto add = [&](const char* kind, const std::string& name) {
    const std::string alternative = fmt::format("{}:{}", kind, name);
    if (MayVouchFor(authority, alternative, now_s)) {
      alternatives.push_back(alternative);
    } else {
      made.left_out.push_back(name);
    }
  };
  for (const std::string& host : names.hosts) {
    add("DNS", host);
  }
  for (const std::string& address : names.addresses) {
    add("IP", address);
  }
  made.identity = SignServer(authority, alternatives, now_s);
  return made;
}

bool IsFor(const std::string& certificate_pem, const std::string& name) {
  const Certificate certificate = ReadCertificate(certificate_pem);
  return X509_check_host(certificate.get(), name.data(), name.size(), 0, nullptr) == 1 ||
         X509_check_ip_asc(certificate.get(), name.c_str(), 0) == 1;
}

bool IsGoodFor(const Identity& server, const Identity& authority, const MachineNames& names,
               int64_t now_s, int days) {
  try {
    const Certificate certificate = ReadCertificate(server.certificate_chain_pem);
    const Certificate issuer = ReadCertificate(authority.certificate_chain_pem);
    const Key key = ReadKey(server.private_key_pem);
    const auto has_host = [&](const std::string& host) {
      return X509_check_host(certificate.get(), host.data(), host.size(), 0, nullptr) == 1;
    };
    const auto has_address = [&](const std::string& address) {
      return X509_check_ip_asc(certificate.get(), address.c_str(), 0) == 1;
    };
    return X509_check_private_key(certificate.get(), key.get()) == 1 &&
           Verifies(certificate.get(), issuer.get(), now_s) &&
           Verifies(certificate.get(), issuer.get(), now_s + days * kDay_s) &&
           std::ranges::all_of(names.hosts, has_host) &&
           std::ranges::all_of(names.addresses, has_address);
  } catch (const std::runtime_error&) {
    return false;
  }
}

std::string Fingerprint(const std::string& certificate_pem) {
  const Certificate certificate = ReadCertificate(certificate_pem);
  std::array<uint8_t, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  Check(X509_digest(certificate.get(), EVP_sha256(), digest.data(), &size) == 1, "a fingerprint");
  std::string text;
  for (unsigned int i = 0; i < size; ++i) {
    text += fmt::format("{}{:02X}", i == 0 ? "" : ":", digest[i]);
  }
  return text;
}

int64_t BeginOf(const std::string& certificate_pem) {
  return SecondsOf(X509_get0_notBefore(ReadCertificate(certificate_pem).get()));
}

int64_t ExpiryOf(const std::string& certificate_pem) {
  return SecondsOf(X509_get0_notAfter(ReadCertificate(certificate_pem).get()));
}

std::string ToDer(const std::string& certificate_pem) {
  const Certificate certificate = ReadCertificate(certificate_pem);
  const Memory memory(BIO_new(BIO_s_mem()));
  Check(i2d_X509_bio(memory.get(), certificate.get()) == 1, "a certificate");
  return TextOf(memory.get());
}

}  // namespace pangea
