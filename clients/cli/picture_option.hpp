// Is the option with which a verb is asked for a picture: one name, one help text, wrong names refused before any work.
//
// Model: `--picture` where the picture stands beside another result, `--out` where it is the verb's result. Threads: one.
#pragma once

#include <CLI/App.hpp>
#include <string>

namespace lambdajet::cli {

inline std::string PictureSuffixFault(const std::string& path) {
  return path.ends_with(".svg") || path.ends_with(".png")
             ? ""
             : "a picture is written as .svg or .png, not as '" + path + "'";
}

inline CLI::Option* AddPictureOption(CLI::App& verb, const char* name, std::string& path,
                                     const std::string& of_what) {
  return verb.add_option(name, path, "picture " + of_what + "; .svg or .png")->check(PictureSuffixFault);
}

}  // namespace lambdajet::cli
