// Says whether every double of a message, and of the messages in it, is a finite number.
#pragma once

#include <google/protobuf/message.h>

#include <cmath>
#include <vector>

namespace lambdajet::fuzz {

inline bool AllFinite(const google::protobuf::Message& message) {
  using google::protobuf::FieldDescriptor;
  const auto& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    const int count = field->is_repeated() ? reflection.FieldSize(message, field) : 1;
    for (int i = 0; i < count; ++i) {
      if (field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
        if (!std::isfinite(field->is_repeated() ? reflection.GetRepeatedDouble(message, field, i)
                                                : reflection.GetDouble(message, field))) {
          return false;
        }
      } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
        if (!AllFinite(field->is_repeated() ? reflection.GetRepeatedMessage(message, field, i)
                                            : reflection.GetMessage(message, field))) {
          return false;
        }
      }
    }
  }
  return true;
}

}  // namespace lambdajet::fuzz
