# docker build -t osimlite . && docker run --rm -v "$PWD:/work" osimlite validate .
FROM python:3.13-slim
COPY . /source
# The compiler makes the library of kernels, and is not needed afterwards.
RUN apt-get update && apt-get install -y --no-install-recommends g++ \
    && pip install --no-cache-dir --only-binary :all: '/source[all]' \
    && apt-get purge -y --auto-remove g++ && rm -rf /source /var/lib/apt/lists/*
RUN osimlite --version -v && osimlite demo -o /tmp/demo && rm -r /tmp/demo
WORKDIR /work
ENTRYPOINT ["osimlite"]
