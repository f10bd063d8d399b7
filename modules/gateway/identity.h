#pragma once

// By what the gateway is known, in the site's folder:
//
//   gateway/ca.pem, ca.key           its authority, made at the first start; ca.key has mode 0600
//   gateway/server.pem, server.key   its certificate; made again at a start when it runs out within
//                                    30 days, or the machine has another name or address
//   gateway/address.json             where it was last reached: "url", "fingerprint" of the
//   authority

#include <string>
#include <vector>

#include "gateway/certificates.h"
#include "site/site.h"

namespace pangea {

struct GatewayIdentity {
  Identity server;
  std::string authority_pem;          // empty: the certificate is the user's own
  std::vector<std::string> left_out;  // names that the authority may not vouch for
};

// Reads it, and makes what is missing. Throws std::runtime_error naming the file and the mend.
GatewayIdentity OpenIdentity(const site::Site& site, const MachineNames& names, int64_t now_s);
// The user's own, of PEM files. Throws std::runtime_error.
GatewayIdentity ReadIdentity(const std::string& certificate_file, const std::string& key_file);

struct GatewayAddress {
  std::string url;          // "https://192.168.1.7:8443/"
  std::string fingerprint;  // of the authority, or of the user's certificate
};
void WriteAddress(const site::Site& site, const GatewayAddress& address);
// Throws std::runtime_error: the gateway never ran here.
GatewayAddress ReadAddress(const site::Site& site);

}  // namespace pangea
