# docker build -t osimlite . && docker run --rm -v "$PWD:/work" osimlite validate .
FROM python:3.13-slim
COPY . /source
RUN pip install --no-cache-dir --only-binary :all: '/source[all]' && rm -r /source
# Laws are compiled once, here: the first motion of a container does not wait for that.
ENV NUMBA_CACHE_DIR=/var/cache/osimlite
RUN osimlite demo -o /tmp/demo && rm -r /tmp/demo
WORKDIR /work
ENTRYPOINT ["osimlite"]
