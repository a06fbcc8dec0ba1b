"""Other aircraft that are told of over a vehicle's link: messages in, the picture of what flies around out."""
