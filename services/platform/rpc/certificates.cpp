#include "platform/rpc/certificates.hpp"

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <memory>

#include "foundation/contract/trouble.hpp"
#include "platform/process/atomic_file.hpp"

namespace lambdajet {
namespace {

constexpr std::size_t kMostPemBytes = 1 << 20;

using Bio = std::unique_ptr<BIO, decltype(&BIO_free)>;
using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;
using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;

absl::Status Bad(const char* reason, const std::string& file, const std::string& what) {
  return Trouble(absl::StatusCode::kInvalidArgument, reason, file + " " + what, {{"path", file}});
}

// Refuses instead of asking on the terminal.
int NoPassword(char*, int, int, void*) { return 0; }

absl::Status ReadCertificate(const std::string& file, Certificate& certificate) {
  const auto pem = ReadPem(file);
  if (!pem.ok()) {
    return pem.status();
  }
  const Bio bio(BIO_new_mem_buf(pem->data(), static_cast<int>(pem->size())), BIO_free);
  certificate.reset(PEM_read_bio_X509(bio.get(), nullptr, NoPassword, nullptr));
  return certificate ? absl::OkStatus() : Bad("BAD_CERTIFICATE", file, "holds no PEM certificate");
}

}  // namespace

absl::StatusOr<std::string> ReadPem(const std::string& file) {
  auto pem = ReadWholeFile(file, kMostPemBytes);
  if (pem.ok()) {
    return pem;
  }
  return Trouble(pem.status().code(), TroubleReason(pem.status()),
                 std::string(pem.status().message()) + "; a PEM file that this user may read is right",
                 {{"path", file}});
}

absl::Status CheckCertificates(const std::string& file) {
  Certificate certificate(nullptr, X509_free);
  return ReadCertificate(file, certificate);
}

absl::Status CheckKeyPair(const std::string& certificate_file, const std::string& key_file) {
  Certificate certificate(nullptr, X509_free);
  if (absl::Status status = ReadCertificate(certificate_file, certificate); !status.ok()) {
    return status;
  }
  const auto pem = ReadPem(key_file);
  if (!pem.ok()) {
    return pem.status();
  }
  const Bio bio(BIO_new_mem_buf(pem->data(), static_cast<int>(pem->size())), BIO_free);
  const Key key(PEM_read_bio_PrivateKey(bio.get(), nullptr, NoPassword, nullptr), EVP_PKEY_free);
  if (!key) {
    return Bad("BAD_KEY", key_file, "holds no PEM private key without a password");
  }
  if (X509_check_private_key(certificate.get(), key.get()) != 1) {
    return Bad("KEY_MISMATCH", key_file, "is not the key of the certificate in " + certificate_file);
  }
  return absl::OkStatus();
}

}  // namespace lambdajet
